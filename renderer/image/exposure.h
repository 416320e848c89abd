/* SPDX-License-Identifier: MIT */
/* The exposure at which a picture looks as a photographer would have it: metered as Reinhard et al.
 * 2002, "Photographic Tone Reproduction for Digital Images", section 3, do, with the log-average
 * luminance at middle grey, but over a part of a histogram. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_EXPOSURE_H
#define VITRAIL_RENDERER_IMAGE_EXPOSURE_H

#include "renderer/image/image.h"

#define EXPOSURE_MIDDLE_GREY 0.18
#define EXPOSURE_MOST_EV 16      /* and as much below 0 */
#define EXPOSURE_STEPS_PER_EV 64 /* what is metered is a whole number of them */

/* linear: F32 RGBA, Rec.709, associated alpha. Of the pixels with light (alpha > 0, luminance above
 * 2^-32), weighted by alpha, those between the 25 % darkest and the 5 % brightest come to middle
 * grey in the mean of logarithms. Where the brightest 5 % would then lie above 1 in the same mean,
 * it is less, by a stop at most. 0 where no pixel has light. */
float exposure_meter(const struct image *linear);

#endif

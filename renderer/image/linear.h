/* SPDX-License-Identifier: MIT */
/* From what a screen shows back to linear light. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_LINEAR_H
#define VITRAIL_RENDERER_IMAGE_LINEAR_H

#include <math.h>

#include "renderer/image/image.h"

/* IEC 61966-2-1, both in [0, 1]. */
static inline double srgb_to_linear(double encoded)
{
    return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

/* srgb: U8 RGBA as image_decode returns it, unassociated alpha. linear: becomes F32 RGBA, Rec.709
 * by the inverse of IEC 61966-2-1, associated alpha. Tone mapping and exposure, if there were any,
 * stay in. Empty on failure. */
MUST_CHECK bool image_linear_from_srgb(const struct image *srgb, struct image *linear,
                                       struct error *err);

#endif

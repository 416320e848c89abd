/* SPDX-License-Identifier: MIT */
/* FLIP: how strongly a person sees the difference when two images alternate on a screen, per pixel
 * from 0 (none) to 1. Written from the papers:
 * LDR-FLIP: Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild 2020, "FLIP: A
 * Difference Evaluator for Alternating Images", sections 4 and 5.
 * HDR-FLIP: Andersson, Nilsson, Shirley, Akenine-Moller 2021, "Visualizing Errors in Rendered High
 * Dynamic Range Images", section 3: the largest LDR-FLIP over a series of exposures.
 * Pure C, no GL. Thread: any. */
#ifndef VITRAIL_RENDERER_ACCURACY_FLIP_H
#define VITRAIL_RENDERER_ACCURACY_FLIP_H

#include "renderer/accuracy/metrics.h"

/* A screen of 3840 pixels on 0.7 m, seen from 0.7 m: 3840 * pi / 180 (the papers' default). */
#define FLIP_PIXELS_PER_DEGREE 67.020643276582255

enum { FLIP_EXPOSURES_MAX = 32 };

struct flip_desc {
    /* Required; F32, of one size and channel count. One or two channels are grey (and alpha), three
     * or more begin with linear Rec.709. Alpha is not looked at: associated, as in EXR, the images
     * are seen over black. */
    const struct image *image, *reference;
    double pixels_per_degree; /* [1, 1000]; 0 means FLIP_PIXELS_PER_DEGREE */
    bool is_hdr; /* false: values are cut to [0, 1], as a screen without tone mapping would */
};

struct flip {
    double mean, p99, max; /* [0, 1]; over the pixels that are finite in both images */
    int max_x, max_y;
    double pixels_per_degree;
    uint64_t nonfinite_pixels; /* with NaN or infinity in either image: black to their neighbours, 1
                                  in the map, not in the values above */
    /* HDR only. From the reference's brightest pixel to its median (ACES curve at 0.85). Where the
     * papers leave it open: a median of 0 becomes that of the lit pixels, a reference without light
     * that of the image; more than FLIP_EXPOSURES_MAX stops are covered in wider steps; negative
     * radiance is 0. */
    int exposures;
    double first_exposure_ev, last_exposure_ev;
};

/* map: optional, becomes an image of one F32 channel; empty on failure. Errors as
 * image_pair_check, and ERROR_INVALID_REQUEST for pixels_per_degree. Memory: one float per pixel
 * and a few MB. */
MUST_CHECK bool flip_measure(const struct flip_desc *desc, struct flip *flip, struct image *map,
                             struct error *err);

#endif

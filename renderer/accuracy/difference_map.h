/* SPDX-License-Identifier: MIT */
/* Pictures of differences, in colours that order by lightness. Thread: any. */
#ifndef VITRAIL_RENDERER_ACCURACY_DIFFERENCE_MAP_H
#define VITRAIL_RENDERER_ACCURACY_DIFFERENCE_MAP_H

#include "renderer/accuracy/metrics.h"

enum difference_map_kind {
    DIFFERENCE_MAP_FLIP,     /* 0 black, 1 pale yellow ("magma") */
    DIFFERENCE_MAP_ABSOLUTE, /* the largest |image - reference|, in the same colours */
    DIFFERENCE_MAP_SIGNED,   /* mean of image - reference over the channels: too dark is blue, equal
                                is white, too bright is red */
};

struct difference_map_desc {
    enum difference_map_kind kind;
    const struct image *image, *reference; /* required but for FLIP; F32, of one shape */
    const struct image *flip;              /* required for FLIP: the map of flip_measure */
    int channels; /* the first so many count; 0 means all; not more than the images have */
    double scale; /* the difference at the end of the colours; 0 means the largest there is, or 1
                     for FLIP and for images without a difference */
};

/* picture: becomes U8 RGB of the images' size; *scale: what was used. Pixels that are not finite in
 * both images are pure green, which is no colour of either scale. */
MUST_CHECK bool difference_map_draw(const struct difference_map_desc *desc, struct image *picture,
                                    double *scale, struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* Measures where shadows end: the distance between the iso-contours of two images or probe grids.
 * It is a measure of geometry: the shading on either side does not matter. Thread: any. */
#ifndef VITRAIL_RENDERER_ACCURACY_EDGES_H
#define VITRAIL_RENDERER_ACCURACY_EDGES_H

#include "renderer/accuracy/metrics.h"

struct edge_distance_desc {
    const struct image *image, *reference; /* required; F32, of one size and channel count */
    int channel;
    double level; /* of the contour; 0 means 0.5, as for transmittance */
};

/* Contours by marching squares between pixel centres, positions by linear interpolation, so a
 * straight edge is found to a small fraction of a pixel. Distances in pixels. */
struct edge_distance {
    double hausdorff_px; /* largest distance from a point of either contour to the other one;
                            INFINITY when only one image has a contour, 0 when neither has */
    double mean_px;      /* the same, averaged over the length of both contours */
    double length_image_px, length_reference_px;
    int max_x, max_y;     /* pixel of the largest distance */
    uint64_t blind_cells; /* squares of four pixels with a value that is not finite, in either
                             image: no contour is drawn there in both */
};

/* Errors as image_pair_check, and ERROR_INVALID_REQUEST for the channel or a level that is not
 * finite. An image of one row or column has no contour. Cost: the length of the contours times how
 * far they are apart. */
MUST_CHECK bool edge_distance_measure(const struct edge_distance_desc *desc,
                                      struct edge_distance *distance, struct error *err);

#endif

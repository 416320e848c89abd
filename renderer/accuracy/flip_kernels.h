/* SPDX-License-Identifier: MIT */
/* The filters of FLIP as separable kernels: the blur of the eye at a distance, and the detectors of
 * edges and points. Thread: any. */
#ifndef VITRAIL_RENDERER_ACCURACY_FLIP_KERNELS_H
#define VITRAIL_RENDERER_ACCURACY_FLIP_KERNELS_H

#include "protocol/error.h"

/* One-dimensional weights; each is used along rows and along columns. */
enum flip_kernel {
    FLIP_ACHROMATIC,    /* sum 1 */
    FLIP_RED_GREEN,     /* sum 1 */
    FLIP_BLUE_YELLOW_1, /* the two squared sums add up to 1: the filter is a sum of two Gaussians */
    FLIP_BLUE_YELLOW_2,
    FLIP_SMOOTH, /* sum 1 */
    FLIP_EDGE,   /* first derivative; positive weights sum to 1, negative ones to -1 */
    FLIP_POINT,  /* second derivative; the same */
    FLIP_KERNEL_COUNT
};

struct flip_kernels {
    int radius[FLIP_KERNEL_COUNT];     /* [px] */
    float *weights[FLIP_KERNEL_COUNT]; /* owned; [2 * radius + 1] */
    int largest_radius;
};

MUST_CHECK bool flip_kernels_init(struct flip_kernels *kernels, double pixels_per_degree,
                                  struct error *err);
void flip_kernels_finish(struct flip_kernels *kernels); /* accepts zeroed and half-built */

#endif

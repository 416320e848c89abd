/* SPDX-License-Identifier: MIT */
/* A skinned figure amid parts that stand, as a GLB. Thread: any. */
#ifndef VITRAIL_TESTS_BENCH_SKINNED_FIGURE_H
#define VITRAIL_TESTS_BENCH_SKINNED_FIGURE_H

#include <stddef.h>

enum { FIGURE_JOINTS = 8, FIGURE_SIDES = 64 };

struct skinned_figure_desc {
    int rings; /* of FIGURE_SIDES vertices each, at least 2 */
    int parts; /* boxes around it that stand */
};

/* A tube of 0.2 m and 2 m height above the origin on a chain of joints, each of which turns about Z
 * by 10 degrees from 0 to 1 s and back until 2 s; boxes of 0.2 m on the floor around it. Owned by
 * the caller: free(). Never NULL: a lack of memory ends the program. */
void *skinned_figure_build(const struct skinned_figure_desc *desc, size_t *size_bytes);

#endif

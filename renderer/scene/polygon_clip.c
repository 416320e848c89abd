/* SPDX-License-Identifier: MIT */
/* Clipping by half-spaces. */
#include "renderer/scene/polygon_clip.h"

#include <assert.h>
#include <stdbool.h>
#include <string.h>

#include "renderer/base/matrix.h"

double plane_height(const double plane[4], const double point[3])
{
    return vec3_dot(plane, point) + plane[3];
}

int points_compare(const double a[3], const double b[3])
{
    for (int k = 0; k < 3; k++)
        if (a[k] != b[k])
            return a[k] < b[k] ? -1 : 1;
    return 0;
}

void plane_meet(const double plane[4], const double a[3], const double b[3], double out[3])
{
    if (points_compare(a, b) > 0) {
        plane_meet(plane, b, a, out);
        return;
    }
    double above_a = plane_height(plane, a), above_b = plane_height(plane, b);
    double t = above_a / (above_a - above_b);
    for (int k = 0; k < 3; k++)
        out[k] = above_a == 0 ? a[k] : above_b == 0 ? b[k] : a[k] + t * (b[k] - a[k]);
}

int polygon_clip(const double plane[4], double (*corners)[3], int count)
{
    double kept[POLYGON_CORNERS_MAX][3];
    int kept_count = 0, crossings = 0;
    assert(count < POLYGON_CORNERS_MAX);
    for (int i = 0; i < count; i++) {
        const double *a = corners[i], *b = corners[(i + 1) % count];
        bool is_a_kept = plane_height(plane, a) >= 0, is_b_kept = plane_height(plane, b) >= 0;
        if (is_a_kept)
            memcpy(kept[kept_count++], a, sizeof *kept);
        if (is_a_kept != is_b_kept && crossings++ < 2)
            plane_meet(plane, a, b, kept[kept_count++]);
    }
    memcpy(corners, kept, (size_t)kept_count * sizeof *kept);
    return kept_count;
}

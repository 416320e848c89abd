/* SPDX-License-Identifier: MIT */
/* The share of a pixel that a half plane covers, in closed form. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_HALF_PLANE_H
#define VITRAIL_TESTS_SUPPORT_HALF_PLANE_H

#include <math.h>
#include <stdbool.h>

/* Points p with dot(normal, p) < offset, in pixels. */
struct half_plane {
    double normal[2]; /* unit */
    double offset;
};

/* How far the point is from the border; positive: outside. */
static inline double half_plane_distance(const struct half_plane *plane, double x, double y)
{
    return plane->normal[0] * x + plane->normal[1] * y - plane->offset;
}

static inline bool half_plane_has(const struct half_plane *plane, double x, double y)
{
    return half_plane_distance(plane, x, y) < 0;
}

/* Of the pixel around that centre: the distances of its points have a trapezoid's density. */
static inline double half_plane_share(const struct half_plane *plane, double x, double y)
{
    double a = fabs(plane->normal[0]), b = fabs(plane->normal[1]);
    double least = fmin(a, b), most = fmax(a, b);
    double half = 0.5 * (a + b), flat = 0.5 * (most - least);
    double inside = -half_plane_distance(plane, x, y), away = fabs(inside), share = 0.5;
    if (away >= half)
        share = 1;
    else if (away <= flat)
        share = 0.5 + away / most;
    else
        share = 1 - (half - away) * (half - away) / (2 * least * most);
    return inside < 0 ? 1 - share : share;
}

#endif

/* SPDX-License-Identifier: MIT */
/* The footprint of a pixel on the triangle that its ray meets. Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_FOOTPRINT_H
#define VITRAIL_RENDERER_RAYTRACE_RT_FOOTPRINT_H

#include "renderer/raytrace/rt_scene.h"

/* How far a hit moves on its triangle, in u and v of rt_hit, from one pixel to the next. */
struct rt_footprint {
    double right[2], down[2];
};

/* Igehy 1999, "Tracing Ray Differentials", eq. 10 and 12, which for straight rays through a plane
 * are exact. way: how far the rays of the next pixels, to the right and down, pass from the hit's
 * point [m]; direction: of the ray, of any length. */
void rt_footprint_find(const struct rt_scene *scene, const struct rt_hit *hit,
                       const double way[2][3], const double direction[3],
                       struct rt_footprint *footprint);

#endif

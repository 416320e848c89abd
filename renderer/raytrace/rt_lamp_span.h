/* SPDX-License-Identifier: MIT */
/* Where a straight way is in the range and in the cone of a lamp. Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_LAMP_SPAN_H
#define VITRAIL_RENDERER_RAYTRACE_RT_LAMP_SPAN_H

#include "renderer/raytrace/rt_scene.h"

struct rt_span { /* of a way [m]; empty: to is not above from */
    double from, to;
};

/* No light of a point or spot light arrives on the way, [0, INFINITY) from its origin on, outside
 * of this; the whole way of other lights. origin: relative to rt_scene.origin; way: unit. */
struct rt_span rt_lamp_span(const struct rt_scene *scene, const struct state_light *light,
                            const double origin[3], const double way[3]);

#endif

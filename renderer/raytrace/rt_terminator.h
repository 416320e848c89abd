/* SPDX-License-Identifier: MIT */
/* Finds where the shadow rays of smooth meshes begin (Hanika 2021, "Hacking the Shadow Terminator",
 * Ray Tracing Gems II, chapter 4): on the curved surface that the vertices' normals describe. On
 * the triangle below it, other faces of the mesh would shadow the point. Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_TERMINATOR_H
#define VITRAIL_RENDERER_RAYTRACE_RT_TERMINATOR_H

#include "renderer/raytrace/rt_scene.h"

struct rt_smooth_start {
    double offset[3]; /* [m], from the point */
    double normal[3]; /* interpolated, unit, on the side of the viewer */
};

/* False: the triangle is flat, its vertices have one normal. point: relative to rt_scene.origin. */
bool rt_terminator_find(const struct rt_scene *scene, const struct rt_hit *hit,
                        const double point[3], struct rt_smooth_start *start);

#endif

/* SPDX-License-Identifier: MIT */
/* The nodes along the columns of a window at which the light in density grids is found
 * (renderer/shading/smoke.h). Columns are those of haze (renderer/scene/atmosphere_grid.h). Pure
 * functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_SMOKE_NODES_H
#define VITRAIL_RENDERER_SCENE_SMOKE_NODES_H

#include "renderer/scene/camera.h"

/* From the nearest depth of a grid to the farthest [m], of the whole view, so that tiles agree. The
 * cells between them grow with the depth, at most by a factor of 64. */
struct smoke_nodes {
    double first_m, length_m;
    double growth; /* log2 of how much longer the last cell is than the first; > 0 */
    int cells;     /* by quality.atmosphere_samples; one more than these are the nodes */
};
struct smoke_nodes smoke_nodes_of(const struct view *view, const struct scene_state *state,
                                  const struct camera *camera);

enum { SMOKE_NODE_BYTES = 4 * sizeof(float) };
/* What the light at nodes takes for a pixel; 0 without grids. */
uint64_t smoke_pixel_bytes(const struct view *view, const struct scene_state *state);

/* The place of a depth among the nodes, as in shaders/shading/smoke_nodes.glsl. */
double smoke_node_at(const struct smoke_nodes *nodes, double view_z);

#endif

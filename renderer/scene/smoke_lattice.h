/* SPDX-License-Identifier: MIT */
/* Points over the boxes of density grids at which their optical depth towards each light is kept
 * (renderer/shading/smoke_depths.h): whether that pays, and what it takes. Pure functions. Thread:
 * any. */
#ifndef VITRAIL_RENDERER_SCENE_SMOKE_LATTICE_H
#define VITRAIL_RENDERER_SCENE_SMOKE_LATTICE_H

#include "renderer/scene/camera.h"

struct smoke_lattice {
    uint64_t points; /* of all grids */
    int channels;    /* 1 where one colour dims like another in all grids, else 3 */
};
struct smoke_lattice smoke_lattice_of(const struct scene_state *state);

/* Steps from face to face along each axis, with a point at either end: two for each voxel, and no
 * longer than a 64th of the longest side. */
void smoke_lattice_steps(const struct state_grid *grid, uint32_t steps[3]);

enum { SMOKE_DEPTH_BYTES = 4 }; /* two halves: a point and the next along x */
/* Of all lights of the state. */
uint64_t smoke_lattice_bytes(const struct scene_state *state);

/* Whether the nodes of the picture (smoke_nodes.h) look depths up: they fit, and at least as many
 * nodes lie in smoke, by the boxes of the grids and the share of their bricks that have values, as
 * there are points, so that the lights' ways to all points are no more work than those to the
 * nodes. Of the whole view, so that tiles agree. camera: NULL: whether it may be so from
 * somewhere. */
bool smoke_lattice_serves(const struct view *view, const struct scene_state *state,
                          const struct camera *camera, uint64_t most_bytes);

#endif

/* SPDX-License-Identifier: MIT */
/* Density grids as shaders read them (shaders/lights/density_grids.glsl): bricks of 8 x 8 x 8
 * cells between centres of voxels, with all 9 x 9 x 9 voxels around, so that a cell is looked up in
 * one brick. Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_GRID_TEXELS_H
#define VITRAIL_RENDERER_SCENE_GRID_TEXELS_H

#include "renderer/scene/scene_state.h"

enum {
    GRID_BRICK_PAIRS = 8 * 9 * 9, /* of a voxel and the next along x; x fastest, then y, then z */
    GRID_BRICKS_MAX = 1 << 17,    /* with values: 680 MB, and fewer texels than devices can read */
    GRID_SIDES_MAX = 4096, /* sum of the sides of all grids that are seen: loops go through all */
};

/* Why rasterised pictures cannot show the grids of a state: a clause. NULL: they can. */
const char *grid_texels_excess(const struct scene_state *state);

struct grid_texels {
    uint32_t *first_brick; /* owned; of each grid of the scene */
    /* Owned; 1 + index in `pairs`; 0: empty. Of one grid as many as there are cells of 8 voxels
     * between its centres along each axis, at least one; x fastest. */
    uint32_t *bricks;
    uint64_t brick_count;
    float (*pairs)[GRID_BRICK_PAIRS][2]; /* owned */
    uint64_t filled_count;
};
MUST_CHECK bool grid_texels_init(struct grid_texels *texels, const struct scene *scene,
                                 struct error *err);
void grid_texels_finish(struct grid_texels *texels); /* accepts zeroed */

#endif

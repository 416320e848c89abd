/* SPDX-License-Identifier: MIT */
/* The density grids that a view sees: placed, with their factors. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_STATE_GRIDS_H
#define VITRAIL_RENDERER_SCENE_STATE_GRIDS_H

#include "renderer/scene/density_grid.h"

struct state_grid {       /* one visible node's */
    uint32_t node, index; /* index: of the scene's grids */
    struct density_grid values;
    double voxel_from_world[16]; /* affine */
    double world_from_voxel[16];
    double sigma[3]; /* extinction of a value of 1 [1/m], world lengths */
    float color[3];  /* of scattering [0,1] */
    float anisotropy;
    float largest;                       /* of the values */
    double bounds_min[3], bounds_max[3]; /* world */
    uint64_t shadow_hash;                /* of all that decides its shadow */
};

struct scene_state;
struct view;

/* The integral of the values along a way [m] behind which nothing counts: all channels have lost
 * all but 2e-9. INFINITY where a channel passes. */
double state_grid_dark_m(const struct state_grid *grid);

/* Lists the grids of visible nodes with the overrides of the view, those that hide nothing and
 * those of nodes without a volume left out, and grows the bounds of the state. ERROR_NOT_FOUND
 * names an unknown grid. */
MUST_CHECK bool state_grids_init(struct scene_state *state, const struct view *view,
                                 struct error *err);
void state_grids_finish(struct scene_state *state);

/* Henyey and Greenstein 1941: as atmosphere_phase. */
double state_grid_phase(const struct state_grid *grid, double cosine);

#endif

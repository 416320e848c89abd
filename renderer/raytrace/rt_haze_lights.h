/* SPDX-License-Identifier: MIT */
/* Light in the columns of a haze grid. Internal to rt_haze_grid. Thread: one per worker. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_HAZE_LIGHTS_H
#define VITRAIL_RENDERER_RAYTRACE_RT_HAZE_LIGHTS_H

#include "renderer/raytrace/rt_haze_grid.h"

/* Columns that send their rays together, in squares of this side. */
enum { RT_HAZE_BLOCK = 4 };

struct rt_haze_making { /* struct rt_job's shared */
    struct rt_haze_grid *grid;
    const struct rt_light_set *light_set;
};

/* Fills grid->lights; a unit is a block. */
extern const struct rt_form rt_haze_lights_form;
int rt_haze_blocks(const struct rt_haze_grid *grid);

/* The ray along the middle of a column, through the eye's plane at depth 0. Returns metres of it
 * per metre of depth. */
double rt_haze_column(const struct rt_haze_grid *grid, int column, int row, double origin[3],
                      double way[3]);

#endif

/* SPDX-License-Identifier: MIT */
/* Lamps that are seen in haze (renderer/scene/haze_glow.h). The columns around such a lamp keep its
 * light apart, too; rays that pass near it leave that out, and find its light along their own way.
 * Thread: as of the grid. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_HAZE_GLOW_H
#define VITRAIL_RENDERER_RAYTRACE_RT_HAZE_GLOW_H

#include "renderer/raytrace/rt_haze.h"
#include "renderer/raytrace/rt_haze_grid.h"

/* Finds the lamps, and makes room. */
MUST_CHECK bool rt_haze_glows_find(struct rt_haze_grid *grid, struct error *err);
void rt_haze_glows_finish(struct rt_haze_grid *grid); /* accepts zeroed */

/* What a light adds to a slice of a column, whose number in grid->lights this is. */
void rt_haze_glows_take(struct rt_haze_grid *grid, uint32_t light, size_t slice,
                        const float added[3]);
void rt_haze_glows_sum_up(struct rt_haze_grid *grid);

/* Takes away from what the grid has up to a depth what the ray finds by itself. */
void rt_haze_glows_leave(const struct rt_haze_sight *sight, double z, double scattered[3]);

/* Adds that, on a stretch of the sight's ray; as rt_haze_add_lamp. */
void rt_haze_glows_add(const struct rt_haze_sight *sight, struct rt_lighting *lighting,
                       const struct rt_haze_way *way, const double share[3], double radiance[3]);

#endif

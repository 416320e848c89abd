/* SPDX-License-Identifier: MIT */
/* Lamps that are seen in rasterised haze (renderer/scene/haze_glow.h). Squares of pixels around
 * them have their light along each pixel's own way, in the place of what the columns of the grid
 * (renderer/shading/atmosphere_light.h) have of it: those columns and ways are lit beside the grid,
 * and when the picture is there, the difference is added. Programs of other pixels know nothing of
 * it. Not with density grids, nor where rays light the haze. Thread: GL, but for the list. */
#ifndef VITRAIL_RENDERER_SHADING_ATMOSPHERE_GLOW_H
#define VITRAIL_RENDERER_SHADING_ATMOSPHERE_GLOW_H

#include "renderer/shading/shade.h"
#include "renderer/window/surface_set.h"

/* Whether the window has such pixels. */
bool atmosphere_glow_is_there(const struct window_frame *frame);
/* Bytes that the lamps of a picture take, at most. Thread: any. */
uint64_t atmosphere_glow_bytes(const struct view *view);

/* Makes room for their light where it is absent. */
MUST_CHECK bool atmosphere_glow_begin(const struct window_frame *frame, struct error *err);
/* The slices of columns and the ways of pixels, which are lit as surfaces are. Behind
 * atmosphere_begin, and with the first chunk of each batch of lights. */
struct surface_set atmosphere_glow_set(const struct window_frame *frame);
/* With the light of all lights: sums it along the columns. */
MUST_CHECK bool atmosphere_glow_end(const struct window_frame *frame, struct error *err);
/* Adds it to the window's image, and to that without what refracts. Nothing where no such pixels
 * are. */
MUST_CHECK bool atmosphere_glow_add(const struct shade_desc *desc, struct error *err);

extern const struct surface_kind atmosphere_glow_ways;
/* The programs of the other two passes. */
void atmosphere_glow_list_programs(const struct window_frame *frame,
                                   const struct shade_facts *facts, struct program_list *list);

#endif

/* SPDX-License-Identifier: MIT */
/* Haze in rasterised pictures (struct view_atmosphere): a grid over the window in which the light
 * that it scatters towards the eye is found, for every pixel and layer to look up. Columns of
 * pixels lie fast in the image and are cut into slices by depth, the last of which has no end
 * (Wronski 2014, "Volumetric Fog: Unified Compute Shader-Based Solution to Atmospheric
 * Scattering"). The light of a slice is that of one point per light, through its shadow; what the
 * haze takes away is exact. Thread: GL, but for the list. */
#ifndef VITRAIL_RENDERER_SHADING_ATMOSPHERE_LIGHT_H
#define VITRAIL_RENDERER_SHADING_ATMOSPHERE_LIGHT_H

#include "renderer/scene/atmosphere_grid.h"
#include "renderer/shadows/shadow_traced.h"
#include "renderer/window/surface_set.h"
#include "renderer/window/window.h"

/* Whether some light of the frame lights the haze of the view. */
bool atmosphere_is_lit(const struct window_frame *frame);

/* Whether the frame has haze, or density grids, which are composited like it. */
bool atmosphere_is_there(const struct window_frame *frame);
/* #define items of programs that look through it, each behind a space; "" where none is there. */
const char *atmosphere_defines(const struct window_frame *frame);
/* What a full albedo scatters of the hemisphere and the map, as from all around. Thread: GL. */
void atmosphere_find_around(const struct window_frame *frame, float around[3]);

/* What programs read that ask how deep the haze is. */
void atmosphere_bind_depth(const struct window_frame *frame, const struct gl_program *program);
/* What lighting and compositing read of it, where it is there. */
void atmosphere_bind(const struct window_frame *frame, const struct gl_program *program);

/* What programs read that light points in the haze. */
void atmosphere_bind_points(const struct window_frame *frame, const struct gl_program *program);
/* Sums slices at corners of columns, over u_atmosphere_grid. */
extern const struct program_desc atmosphere_sum_program;

/* Makes room for the grid where it is absent, and finds how far each column is seen. */
MUST_CHECK bool atmosphere_begin(const struct window_frame *frame, struct error *err);
/* The slices, which are lit as surfaces are. */
struct surface_set atmosphere_set(const struct window_frame *frame);
/* In the place of both, and of the pass that lights the set: rays find the light of the slices. */
MUST_CHECK bool atmosphere_trace(const struct window_frame *frame, struct traced_shadows *traced,
                                 struct error *err);
/* With the light of all lights in the slices: sums it along the columns. */
MUST_CHECK bool atmosphere_end(const struct window_frame *frame, struct error *err);

extern const struct surface_kind atmosphere_points;
/* The programs of the other two passes; is_traced: of the last one. Thread: any. */
void atmosphere_list_programs(const struct window_frame *frame, bool is_traced,
                              struct program_list *list);

#endif

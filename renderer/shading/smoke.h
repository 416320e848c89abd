/* SPDX-License-Identifier: MIT */
/* Density grids in rasterised pictures (docs/explanation/media.md): their values on the device, and
 * the light in them. Each pixel follows its ray through the cells of the grids; each light is
 * dimmed by the cells on its way to a surface, or to a node of the columns over the window, between
 * which pixels look up the light inside. Thread: GL, but for what says so. */
#ifndef VITRAIL_RENDERER_SHADING_SMOKE_H
#define VITRAIL_RENDERER_SHADING_SMOKE_H

#include "renderer/base/content_key.h"
#include "renderer/shading/smoke_depths.h"
#include "renderer/window/surface_set.h"
#include "renderer/window/window.h"

struct smoke {              /* zeroed = nothing is on the device */
    struct content_key key; /* of the scene whose values it has */
    struct gl_buffer bricks, values, records;
    struct gl_texture brick_view, value_view, record_view;
    uint32_t *first_brick; /* owned; by grid of the scene */
    struct smoke_depths depths;
};

/* Puts the grids of the state there as the camera sees them, and the values of its scene unless
 * they are those of the key. Nothing without grids. */
MUST_CHECK bool smoke_prepare(struct smoke *smoke, struct content_key key,
                              const struct scene_state *state, const struct camera *camera,
                              struct error *err);
/* Writes a grid_record of each grid of the state, as a camera there sees them. */
MUST_CHECK bool smoke_upload_records(const struct smoke *smoke, const struct scene_state *state,
                                     const struct camera *camera, struct gl_buffer *records,
                                     struct gl_texture *view, struct error *err);
void smoke_finish(struct smoke *smoke); /* accepts zeroed */
uint64_t smoke_size_bytes(const struct smoke *smoke);

/* Whether some light of the frame shines into grids. Thread: any, as the next two. */
bool smoke_is_lit(const struct window_frame *frame);
/* Steps of the loop along a way through all grids, at most. */
uint64_t smoke_loop_steps(const struct scene_state *state);
/* #define items of programs that light or composite, each behind a space; "" without grids. */
enum { SMOKE_DEFINES_BYTES = 64 };
void smoke_defines(const struct window_frame *frame, char text[SMOKE_DEFINES_BYTES]);

/* What programs that sum their values read; with grids. */
void smoke_bind_values(const struct window_frame *frame, const struct gl_program *program);
/* What lighting and compositing read of them; with grids. */
void smoke_bind(const struct window_frame *frame, const struct gl_program *program);

/* Makes room for the light where it is absent, and finds the depths that nodes look up. yield:
 * NULL: never. */
MUST_CHECK bool smoke_begin(const struct window_frame *frame, const struct yield_point *yield,
                            struct error *err);
/* The nodes, which are lit as surfaces are. */
struct surface_set smoke_set(const struct window_frame *frame);
extern const struct surface_kind smoke_nodes;

#endif

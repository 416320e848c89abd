/* SPDX-License-Identifier: MIT */
/* The optical depth of density grids towards each light, at points over their boxes
 * (renderer/scene/smoke_lattice.h): found once, and looked up at the nodes of pictures as long as
 * grids, light and clip planes stand, wherever the camera is. Whether a picture looks it up is
 * decided by scene, view and device alone. Thread: GL, but for what says so. */
#ifndef VITRAIL_RENDERER_SHADING_SMOKE_DEPTHS_H
#define VITRAIL_RENDERER_SHADING_SMOKE_DEPTHS_H

#include "renderer/base/content_key.h"
#include "renderer/base/yield_point.h"
#include "renderer/window/window.h"

struct smoke_depths { /* zeroed: nothing is kept */
    struct gl_buffer records, depths;
    struct gl_texture record_view, depth_view;
    struct content_key *keys; /* owned; by light: of what its depths are for; zeroed: of nothing */
    size_t light_count;
    uint64_t points; /* of the lattice that they are kept for, as the next */
    int channels;
};

/* What depths may take of a budget for GPU memory on a device [bytes]. Thread: any. */
uint64_t smoke_depths_most(const struct gl_limits *limits, uint64_t budget_bytes);
/* Whether the nodes of the frame look depths up: they are kept within frame->depths, and found with
 * no more work than the nodes would take without. Thread: any, as the next two. */
bool smoke_depths_serve(const struct window_frame *frame);
/* #define items of programs that look them up, behind a space; "" where the frame does not. */
void smoke_depths_defines(const struct window_frame *frame, char text[32]);
void smoke_depths_list_program(const struct window_frame *frame, bool is_conditional,
                               struct program_list *list);

/* Finds the depths that are not kept. For frames that they serve, after smoke_prepare. yield: NULL:
 * never. */
MUST_CHECK bool smoke_depths_prepare(const struct window_frame *frame,
                                     const struct yield_point *yield, struct error *err);
/* What programs that look them up read; after that. */
void smoke_depths_bind(const struct window_frame *frame, const struct gl_program *program);

void smoke_depths_finish(struct smoke_depths *depths); /* accepts zeroed */
uint64_t smoke_depths_size_bytes(const struct smoke_depths *depths);

#endif

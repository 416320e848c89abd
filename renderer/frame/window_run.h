/* SPDX-License-Identifier: MIT */
/* The execution of those steps of a plan that run once a window. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_WINDOW_RUN_H
#define VITRAIL_RENDERER_FRAME_WINDOW_RUN_H

#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_run.h"

/* How a window ended. */
struct window_result {
    bool overflows; /* it has more transparent fragments or shadow rays than one pass can draw, */
    uint64_t missing_bytes; /* or, if not 0, than fit the budget: bytes of its lists */
};

/* Draws the window, and sends its outputs on their way. */
MUST_CHECK bool window_run(const struct frame_run *run, const struct window_budget *budget,
                           const struct camera_window *rectangle, struct window_result *result,
                           struct error *err);

/* Draws its surfaces and counts its layers, where no earlier frame has told how many there are. */
MUST_CHECK bool window_run_count(const struct frame_run *run, const struct camera_window *rectangle,
                                 struct error *err);

/* What passes over the window need to know. */
struct window_frame window_frame_of(const struct frame_run *run,
                                    const struct camera_window *rectangle);

#endif

/* SPDX-License-Identifier: MIT */
/* Batches of lights, for lights whose shadow structures exceed the budget together. For each batch
 * the structures are built and the window is lit; then the next batch takes the memory. Transparent
 * layers attenuate what is behind them, so they are composited only with the last batch. This is
 * the multipass of Lexolights (Peciva 2012, 3.4), with the sums of a single pass. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_LIGHT_BATCHES_H
#define VITRAIL_RENDERER_FRAME_LIGHT_BATCHES_H

#include "renderer/frame/frame_run.h"

/* Builds the shadow structures of all lights if they fit the budget; else light_batches_shade
 * builds them in batches. ERROR_OVER_BUDGET: the structures of one light exceed the budget. */
MUST_CHECK bool light_batches_prepare(const struct frame_run *run, struct error *err);

/* Shades a window (struct shade_desc, without its place among batches) with all lights: at once, or
 * in batches, with the same bits. Its light lists must stand. Errors as above. */
MUST_CHECK bool light_batches_shade(const struct frame_run *run, const struct shade_desc *desc,
                                    struct error *err);

/* Whether frames of the plan are lit in batches, as far as earlier frames show. */
bool light_batches_are_known(const struct frame_context *context, const char *scene_key,
                             const struct view *view, const struct scene_state *state,
                             const struct frame_plan *plan);

#endif

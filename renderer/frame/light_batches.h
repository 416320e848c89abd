/* SPDX-License-Identifier: MIT */
/* Lights whose shadow structures exceed the budget together, but not each by itself: batch by
 * batch their structures are made, the window is lit, and the memory goes to the next. Layers are
 * composited once, with the last batch, so that they attenuate what is behind them once. The
 * multipass of Lexolights (Peciva 2012, 3.4), with the sums of a single pass. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_LIGHT_BATCHES_H
#define VITRAIL_RENDERER_FRAME_LIGHT_BATCHES_H

#include "renderer/frame/frame_run.h"

/* The shadow structures of all lights, where they fit. Where they do not, there are none, and
 * light_batches_shade makes them. ERROR_OVER_BUDGET: one light alone is too much. */
MUST_CHECK bool light_batches_prepare(const struct frame_run *run, struct error *err);

/* Shades a window (struct shade_desc, without its place among batches) with all lights: at once, or
 * in batches, with the same bits. Its light lists must stand. Errors as above. */
MUST_CHECK bool light_batches_shade(const struct frame_run *run, const struct shade_desc *desc,
                                    struct error *err);

/* Whether frames of the plan are lit in batches, as far as the frames before tell. */
bool light_batches_are_known(const struct renderer *renderer, const char *scene_key,
                             const struct view *view, const struct scene_state *state,
                             const struct frame_plan *plan);

#endif

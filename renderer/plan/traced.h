/* SPDX-License-Identifier: MIT */
/* Tells which frames are ray traced. Pure. Thread: any. */
#ifndef VITRAIL_RENDERER_PLAN_TRACED_H
#define VITRAIL_RENDERER_PLAN_TRACED_H

#include "renderer/cost/auto_technique.h"
#include "renderer/frame_report.h"
#include "renderer/scene/scene_state.h"
#include "renderer/view.h"

/* Whether the color output is ray traced; because: the requirement that asks for it, "" where it is
 * not. choice: what `auto` chose for the view. */
bool plan_is_raytraced(const struct view *view, const struct scene_state *state,
                       const struct auto_choice *choice, char because[REPORT_TEXT_BYTES]);

#endif

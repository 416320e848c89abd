/* SPDX-License-Identifier: MIT */
/* Which frames are ray traced. Pure. Thread: any. */
#ifndef VITRAIL_RENDERER_PLAN_TRACED_H
#define VITRAIL_RENDERER_PLAN_TRACED_H

#include "renderer/cost/auto_technique.h"
#include "renderer/frame_report.h"
#include "renderer/scene/scene_state.h"
#include "renderer/view.h"

size_t plan_area_lights(const struct scene_state *state); /* their number */

/* Whether the color output is ray traced; because: the requirement that asks for it, "" where it is
 * not. choice: what `auto` chose for the view. */
bool plan_is_raytraced(const struct view *view, const struct scene_state *state,
                       const struct auto_choice *choice, char because[REPORT_TEXT_BYTES]);

#endif

/* SPDX-License-Identifier: MIT */
/* A frame is ray traced where the request, its area lights or `auto` ask for it. */
#include "renderer/plan/traced.h"

#include <stdio.h>

size_t plan_area_lights(const struct scene_state *state)
{
    size_t count = 0;
    for (size_t i = 0; i < state->light_count; i++)
        count += state_light_is_area(&state->lights[i]);
    return count;
}

bool plan_is_raytraced(const struct view *view, const struct scene_state *state,
                       const struct auto_choice *choice, char because[REPORT_TEXT_BYTES])
{
    const struct view_quality *quality = &view->quality;
    size_t areas = plan_area_lights(state);
    because[0] = 0;
    if (!(view->outputs & 1u << VIEW_OUTPUT_COLOR))
        return false;
    if (quality->reference)
        snprintf(because, REPORT_TEXT_BYTES, "quality.reference asks for the ground truth");
    else if (quality->shadows == SHADOWS_RAYTRACED)
        snprintf(because, REPORT_TEXT_BYTES, "quality.shadows is raytraced");
    else if (quality->shadows == SHADOWS_AUTO && areas)
        snprintf(because, REPORT_TEXT_BYTES, "%zu area light%s: soft shadows are ray traced", areas,
                 areas == 1 ? "" : "s");
    else if (choice->takes_traced)
        snprintf(because, REPORT_TEXT_BYTES, "%s", choice->because);
    return because[0];
}

/* SPDX-License-Identifier: MIT */
/* A frame is ray traced where the request, its area lights or `auto` ask for it. */
#include "renderer/plan/traced.h"

#include <stdio.h>

bool plan_is_raytraced(const struct view *view, const struct scene_state *state,
                       const struct auto_choice *choice, char because[REPORT_TEXT_BYTES])
{
    const struct view_quality *quality = &view->quality;
    size_t areas = scene_state_area_lights(state);
    because[0] = 0;
    if (!(view->outputs & 1u << VIEW_OUTPUT_COLOR))
        return false;
    if (quality->reference)
        snprintf(because, REPORT_TEXT_BYTES, "quality.reference asks for the ground truth");
    else if (shadow_technique_is_renderer(quality->shadows))
        snprintf(because, REPORT_TEXT_BYTES, "quality.shadows is %s",
                 shadow_technique_name((int)quality->shadows));
    else if (quality->shadows == SHADOWS_AUTO && areas &&
             (!choice->is_open || shadow_technique_is_renderer(choice->technique)))
        snprintf(because, REPORT_TEXT_BYTES, "%zu area light%s: soft shadows are ray traced", areas,
                 areas == 1 ? "" : "s");
    else if (shadow_technique_is_renderer(choice->technique))
        snprintf(because, REPORT_TEXT_BYTES, "%s", choice->because);
    return because[0];
}

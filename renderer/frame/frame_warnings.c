/* SPDX-License-Identifier: MIT */
/* Sentences on what a picture approximates or leaves out. */
#include "renderer/frame/frame_warnings.h"

#include <string.h>

#include "renderer/plan/plan_warnings.h"

/* A map that was asked for as one. The studio is a map and a key light that casts shadows. */
static bool shows_map(const struct frame_run *run)
{
    const struct view *view = run->view;
    bool is_lit = view->studio == VIEW_STUDIO_ON || view->studio == VIEW_STUDIO_BY_DEFAULT;
    return run->environment->environment && run->environment->intensity > 0 &&
           !(is_lit && strcmp(view->environment_key, VIEW_STUDIO_KEY) == 0);
}

void frame_warn(const struct frame_run *run)
{
    struct frame_report *report = &run->frame->report;
    const struct plan *plan = &run->frame_plan->plan;
    plan_warn(plan, (int)run->view->quality.transparency, report);
    if (plan->requirements[PLAN_NEED_COLOR].is_met && run->state->item_count && shows_map(run) &&
        !plan->requirements[PLAN_NEED_VISIBILITY].is_met)
        report_warn(report, "the light of the environment map casts no shadows: "
                            "quality.environment_visibility is none");
}

/* SPDX-License-Identifier: MIT */
/* Sentences on what a rasterised picture approximates or leaves out. */
#include "renderer/frame/frame_warnings.h"

#include <string.h>

void frame_warn_of_transparency(const struct frame_run *run)
{
    const struct plan *plan = &run->frame_plan->plan;
    for (int bit = 0; transparency_can_name(bit); bit++)
        if (plan->transparency_lacks >> bit & 1)
            report_warn(&run->frame->report,
                        "transparency %s does not go with %s: %s takes its place",
                        transparency_name((int)run->view->quality.transparency),
                        transparency_can_name(bit), transparency_name((int)plan->transparency->id));
    if (plan->requirements[PLAN_NEED_LAYERS].is_met && plan->requirements[PLAN_NEED_COLOR].is_met &&
        plan->transparency->approximates)
        report_warn(&run->frame->report, "transparency %s %s",
                    transparency_name((int)plan->transparency->id),
                    plan->transparency->approximates);
}

static void warn_of_refraction(const struct frame_run *run)
{
    const struct plan *plan = &run->frame_plan->plan;
    if (plan->requirements[PLAN_NEED_REFRACTION].is_met)
        report_warn(&run->frame->report,
                    "what %zu transparent drawable%s refract%s is looked up in the picture: once "
                    "per pixel, and nothing outside of it; shadows raytraced follows rays",
                    plan->bending_items, plan->bending_items == 1 ? "" : "s",
                    plan->bending_items == 1 ? "s" : "");
}

/* A map that was asked for as one. The studio is a map and a key light that casts shadows. */
static bool shows_map(const struct frame_run *run)
{
    const struct view *view = run->view;
    bool is_lit = view->studio == VIEW_STUDIO_ON || view->studio == VIEW_STUDIO_BY_DEFAULT;
    return run->environment->environment && run->environment->intensity > 0 &&
           !(is_lit && strcmp(view->environment_key, VIEW_STUDIO_KEY) == 0);
}

void frame_warn_of_approximations(const struct frame_run *run)
{
    struct frame_report *report = &run->frame->report;
    const struct plan *plan = &run->frame_plan->plan;
    for (int i = 0; i < plan->lacks.count; i++)
        report_warn(report, "%s", plan->lacks.texts[i]);
    if (plan->requirements[PLAN_NEED_COLOR].is_met && run->state->item_count && shows_map(run) &&
        !plan->requirements[PLAN_NEED_VISIBILITY].is_met)
        report_warn(report, "the light of the environment map casts no shadows: "
                            "quality.environment_visibility is none");
    warn_of_refraction(run);
}

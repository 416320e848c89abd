/* SPDX-License-Identifier: MIT */
/* Warnings that follow from a plan. */
#include "renderer/plan/plan_warnings.h"

#include "protocol/transparency.h"
#include "renderer/transparency/method.h"

/* Rays go through what is transparent in its order, whatever method was named. */
static void warn_of_rays(const struct plan *plan, int asked, struct frame_report *report)
{
    if (plan->requirements[PLAN_NEED_TRACED].is_met && plan->has_layers &&
        asked != TRANSPARENCY_AUTO && asked != TRANSPARENCY_LISTS)
        report_warn(report,
                    "transparency %s does not go with ray traced pictures: rays take its place",
                    transparency_name(asked));
}

static void warn_of_transparency(const struct plan *plan, int asked, struct frame_report *report)
{
    for (int bit = 0; transparency_can_name(bit); bit++)
        if (plan->transparency_lacks >> bit & 1)
            report_warn(report, "transparency %s does not go with %s: %s takes its place",
                        transparency_name(asked), transparency_can_name(bit),
                        transparency_name((int)plan->transparency->id));
    if (plan->requirements[PLAN_NEED_LAYERS].is_met && plan->requirements[PLAN_NEED_COLOR].is_met &&
        plan->transparency->approximates)
        report_warn(report, "transparency %s %s", transparency_name((int)plan->transparency->id),
                    plan->transparency->approximates);
}

static void warn_of_refraction(const struct plan *plan, struct frame_report *report)
{
    if (plan->requirements[PLAN_NEED_REFRACTION].is_met)
        report_warn(report,
                    "what %zu transparent drawable%s refract%s is looked up in the picture: once "
                    "per pixel, and nothing outside of it; shadows raytraced follows rays",
                    plan->bending_items, plan->bending_items == 1 ? "" : "s",
                    plan->bending_items == 1 ? "s" : "");
}

void plan_warn(const struct plan *plan, int asked, struct frame_report *report)
{
    warn_of_rays(plan, asked, report);
    warn_of_transparency(plan, asked, report);
    if (!plan->requirements[PLAN_NEED_COLOR].is_met)
        return;
    for (int i = 0; i < plan->lacks.count; i++)
        report_warn(report, "%s", plan->lacks.texts[i]);
    warn_of_refraction(plan, report);
}

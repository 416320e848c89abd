/* SPDX-License-Identifier: MIT */
/* Sentences on what a rasterised picture approximates or leaves out. */
#include "renderer/frame/frame_warnings.h"

void frame_warn_of_transparency(const struct frame_run *run)
{
    const struct plan *plan = &run->frame_plan->plan;
    for (int bit = 0; transparency_can_name(bit); bit++)
        if (plan->transparency_lacks >> bit & 1)
            report_warn(&run->frame->report,
                        "transparency %s does not go with %s: %s takes its place",
                        transparency_name((int)run->view->quality.transparency),
                        transparency_can_name(bit), transparency_name((int)plan->transparency->id));
}

void frame_warn_of_approximations(const struct frame_run *run)
{
    struct frame_report *report = &run->frame->report;
    const struct plan *plan = &run->frame_plan->plan;
    for (int i = 0; i < plan->lacks.count; i++)
        report_warn(report, "%s", plan->lacks.texts[i]);
    if (plan->samples == 1 && run->view->quality.samples == 4)
        report_warn(report, "the device cannot antialias transparent lists: 1 sample per pixel");
}

/* SPDX-License-Identifier: MIT */
/* Sentences on what a rasterised picture approximates or leaves out, as far as its plan tells: a
 * frame warns of it, and whoever explains the frame tells it before. Thread: any. */
#ifndef VITRAIL_RENDERER_PLAN_PLAN_WARNINGS_H
#define VITRAIL_RENDERER_PLAN_PLAN_WARNINGS_H

#include "renderer/frame_report.h"
#include "renderer/plan/plan.h"

/* asked: the transparency method of the view, of which the plan may have taken another. */
void plan_warn(const struct plan *plan, int asked, struct frame_report *report);

#endif

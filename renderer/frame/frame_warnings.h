/* SPDX-License-Identifier: MIT */
/* Warnings, in the report of a frame, of what its picture lacks. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_WARNINGS_H
#define VITRAIL_RENDERER_FRAME_FRAME_WARNINGS_H

#include "renderer/frame/frame_run.h"

/* What follows from the plan (renderer/plan/plan_warnings.h), and from the view's environment. */
void frame_warn(const struct frame_run *run);

#endif

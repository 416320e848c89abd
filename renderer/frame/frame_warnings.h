/* SPDX-License-Identifier: MIT */
/* Warnings, in the report of a frame, of what its picture lacks. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_WARNINGS_H
#define VITRAIL_RENDERER_FRAME_FRAME_WARNINGS_H

#include "renderer/frame/frame_run.h"

/* The planner has taken another transparency method than the one that was asked for. */
void frame_warn_of_transparency(const struct frame_run *run);
/* Warns of the approximations in a rasterised colour. */
void frame_warn_of_approximations(const struct frame_run *run);

#endif

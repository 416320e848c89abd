/* SPDX-License-Identifier: MIT */
/* Frames whose color is ray traced: how they are made. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_RAYTRACE_H
#define VITRAIL_RENDERER_FRAME_FRAME_RAYTRACE_H

#include "renderer/frame/renderer_internal.h"
#include "renderer/raytrace/raytrace.h"

struct frame_run; /* renderer/frame/frame_run.h */

/* Fills the frame's color output and its report. texture_levels: of struct raytrace_desc. */
MUST_CHECK bool frame_raytrace(const struct frame_run *run, const char *because,
                               const uint8_t *texture_levels, struct error *err);

/* Builds what that keeps, and traces nothing. */
MUST_CHECK bool frame_raytrace_build(const struct frame_run *run, const char *because,
                                     struct error *err);

/* Drops the ray tracer's structure if it is of another scene. */
void frame_drop_other_traced(struct frame_context *context, const char *scene_key);

#endif

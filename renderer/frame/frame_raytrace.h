/* SPDX-License-Identifier: MIT */
/* Frames whose color is ray traced: which ones are, and how they are made. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_RAYTRACE_H
#define VITRAIL_RENDERER_FRAME_FRAME_RAYTRACE_H

#include "renderer/cost/auto_technique.h"
#include "renderer/frame/renderer_internal.h"
#include "renderer/raytrace/raytrace.h"

/* Whether the color output is ray traced; because: the requirement that asks for it, "" where it is
 * not. choice: what `auto` chose for the view. */
bool frame_is_raytraced(const struct view *view, const struct scene_state *state,
                        const struct auto_choice *choice, char because[REPORT_TEXT_BYTES]);

struct frame_run; /* renderer/frame/frame_run.h */

/* Fills the frame's color output and its report. texture_levels: of struct raytrace_desc. */
MUST_CHECK bool frame_raytrace(const struct frame_run *run, const char *because,
                               const uint8_t *texture_levels, struct error *err);

/* Builds what that keeps, and traces nothing. */
MUST_CHECK bool frame_raytrace_build(const struct frame_run *run, const char *because,
                                     struct error *err);

/* Keeps the ray tracer's structure for this scene, and no other. */
void frame_claim_traced(struct renderer *renderer, const char *scene_key);

/* Warns of area lights that a rasterised frame shows as if they had no extent. */
void frame_warn_of_areas(const struct scene_state *state, struct frame_report *report);

#endif

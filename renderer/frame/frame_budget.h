/* SPDX-License-Identifier: MIT */
/* Who may take how much of the budget. Scenes, and structures that rays go through, take what they
 * take; shadow structures take half of the budget, or what scenes leave of it but for an eighth;
 * the rest is for windows, which are drawn so small that what they hold fits. What frames before
 * left goes first: windows, the ray tracer's structure where the frame has no use for it, scenes
 * that no frame shows. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_BUDGET_H
#define VITRAIL_RENDERER_FRAME_FRAME_BUDGET_H

#include "renderer/frame/frame_run.h"

/* Of a frame that shows the scene, before its plan: how much its shadow structures may take,
 * use.shadow_bytes. Drops nothing. */
void frame_budget_share(struct renderer *renderer, const struct resident_scene *scene);
/* That holds from now on, and again after other frames: structures beyond it go. */
void frame_budget_resume(struct renderer *renderer);

/* For struct shadow_system_desc; renderer: the one that is not beside another. */
void frame_budget_claim(void *renderer, uint64_t bytes);

/* Gives back what the renderer keeps of its last window. Not within one. */
void frame_budget_drop_windows(struct renderer *renderer);

/* A frame begins, its textures are there; and ends: in between, its scene stays. */
void frame_budget_begin(const struct frame_run *run);
void frame_budget_end(const struct frame_run *run);
/* In between: whether what it will take for certain fits beside what there is, windows in one piece
 * among it. */
bool frame_budget_holds_all(const struct frame_run *run);
/* Its rays are done: what they went through is kept where it fits beside the rest. */
void frame_budget_end_rays(const struct frame_run *run);

/* What a frame's windows may take, one after the other. */
struct window_budget {
    uint64_t bytes;        /* in all */
    uint64_t pixel_bytes;  /* targets and outputs, for each pixel */
    uint64_t beside_bytes; /* what scenes, shadow structures and rays take */
    uint64_t pause_bytes;  /* left to frames that go first */
};

/* Before the first window; makes room for it. */
struct window_budget frame_budget_windows(const struct frame_run *run);
/* Whether targets and outputs of so many pixels leave room for lists. */
bool window_budget_has_room(const struct window_budget *budget, uint64_t pixels);
/* Says to lists what a window of so many pixels leaves them. What windows before left goes where it
 * is in their way. */
void window_budget_begin(const struct window_budget *budget, const struct frame_run *run,
                         uint64_t pixels);
/* The same for traced shadows, when the lists of surfaces and of lights are there. False where
 * these alone are too many. */
bool window_budget_continue(const struct window_budget *budget, const struct frame_run *run,
                            uint64_t pixels);
/* ERROR_OVER_BUDGET: the window, what it needs and what there is. lacked_bytes: of lists, or 0. */
bool window_budget_refuse(const struct window_budget *budget, const struct frame_run *run,
                          const struct camera_window *window, uint64_t lacked_bytes,
                          struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* Who may take how much of the budget. Scenes, and structures that rays go through, take what they
 * take; shadow structures take half of the budget, or what scenes leave of it but for an eighth;
 * the rest is for windows, which are drawn so small that what they hold fits. What frames before
 * left goes first: windows, the ray tracer's structure where the frame has no use for it, scenes
 * that no frame shows. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_BUDGET_H
#define VITRAIL_RENDERER_FRAME_FRAME_BUDGET_H

#include "renderer/frame/frame_run.h"

/* Sets use.shadow_bytes, how much the shadow structures of a frame with this scene may take. To be
 * called before its plan is made. Evicts nothing. */
void frame_budget_share(struct frame_context *context, const struct resident_scene *scene);
/* Applies that share, now or again after urgent frames: structures beyond it are evicted. */
void frame_budget_resume(struct frame_context *context);

/* What kept depths of density grids may take (smoke_depths_most) [bytes]. Thread: any. */
uint64_t frame_budget_depths(const struct renderer *renderer);

/* The callback of struct shadow_system_desc. */
void frame_budget_reserve(void *renderer, uint64_t bytes);

/* Begin and end of a frame whose textures are resident. Its scene is not evicted in between. */
void frame_budget_begin(const struct frame_run *run);
void frame_budget_end(const struct frame_run *run);
/* In between: whether all that the frame will certainly allocate fits, with whole windows. */
bool frame_budget_holds_all(const struct frame_run *run);
/* The frame's rays are traced: their structure stays if it fits beside the rest. */
void frame_budget_end_rays(const struct frame_run *run);

/* The memory of a frame's windows, which are drawn one after the other. */
struct window_budget {
    uint64_t bytes;       /* that a window may take in all */
    uint64_t pixel_bytes; /* targets and outputs, for each pixel */
    uint64_t other_bytes; /* what scenes, shadow structures and rays take */
    uint64_t pause_bytes; /* left to urgent frames */
};

/* To be called before the first window, for which it makes room. */
struct window_budget frame_budget_windows(const struct frame_run *run);
/* Whether targets and outputs of so many pixels leave room for lists. */
bool window_budget_has_room(const struct window_budget *budget, uint64_t pixels);
/* Tells the lists how much memory a window of so many pixels leaves them, and frees buffers of
 * earlier windows that are in the way. */
void window_budget_begin(const struct window_budget *budget, const struct frame_run *run,
                         uint64_t pixels);
/* The same for traced shadows, after the lists of surfaces and of lights are built. False if these
 * lists alone exceed the budget. */
bool window_budget_continue(const struct window_budget *budget, const struct frame_run *run,
                            uint64_t pixels);
/* Sets ERROR_OVER_BUDGET with the window, its need and the budget. missing_bytes: of lists. */
bool window_budget_refuse(const struct window_budget *budget, const struct frame_run *run,
                          const struct camera_window *window, uint64_t missing_bytes,
                          struct error *err);

#endif

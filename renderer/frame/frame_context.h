/* SPDX-License-Identifier: MIT */
/* A frame context holds the state of one frame at a time: render targets, caches for the next
 * frame, progress. The renderer has two contexts, which share everything else: one for frames, and
 * one for urgent frames that preempt a frame of the first. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_CONTEXT_H
#define VITRAIL_RENDERER_FRAME_FRAME_CONTEXT_H

#include "renderer/cost/choice_cache.h"
#include "renderer/frame/image_cache.h"
#include "renderer/frame/window_cache_keys.h"
#include "renderer/frame/scene_cache.h"
#include "renderer/overlay/feature_edges.h"
#include "renderer/plan/frame_plan.h"
#include "renderer/shading/aov.h"
#include "renderer/shading/shade.h"
#include "renderer/shading/smoke.h"

struct scene_state_cache { /* of the last frame; zeroed = none */
    struct content_key key, cut;
    struct scene_state state;
};

/* The scene as the view sees it: from the cache, or evaluated anew. Valid until the next call. NULL
 * with err. */
const struct scene_state *scene_state_cache_get(struct scene_state_cache *cache,
                                                struct content_key key, const struct scene *scene,
                                                const struct view *view, bool *is_kept,
                                                struct error *err);
void scene_state_cache_drop(struct scene_state_cache *cache);

/* How many lights of the last frame fitted the shadow budget (renderer/frame/light_batches.h). */
struct light_batches { /* zeroed: nothing is known */
    struct content_key key;
    size_t most;          /* structures at once; 0: all */
    uint64_t share_bytes; /* of the budget, for which `most` holds; a larger share is tried anew */
};

/* What the running frame uses of the budget (renderer/frame/frame_budget.h). */
struct budget_use {
    const struct resident_scene *scene;    /* NULL: no frame runs */
    const struct environment *environment; /* that the frame shows; NULL: none */
    bool has_windows, has_rays; /* caches of windows, and of the ray tracer, are in use */
    bool forgets_later;         /* renderer_forget_kept was asked for, and waits for its end */
    uint64_t shadow_bytes;      /* the share of shadow structures */
};

struct frame_context {         /* zeroed: holds nothing */
    struct renderer *renderer; /* the owner; NULL: not initialised */
    bool is_urgent;            /* its frames preempt others, and never yield */
    struct draw_arena *arena;
    struct light_lists *lists;
    struct plan_cache plans;
    struct choice_cache choices;
    struct scene_state_cache state_cache;
    /* The state was made since the last frame: by a choice, or an explanation. */
    bool has_new_state;
    struct light_batches batches;
    struct targets targets;
    struct window_cache_keys cached; /* keys of what targets and layers hold */
    struct image_cache image_cache;
    struct layers layers;
    struct list_history list_history;
    struct time_slice_history time_slice_history;
    struct shade shade;
    struct smoke smoke; /* the density grids of the last scene that was rasterised with some */
    struct aov aov;
    struct traced_shadows shadow_rays;
    struct feature_edges feature_edges; /* of the last scene that they were drawn for */
    char traced_key[SCENE_KEY_BYTES];   /* of the scene that it last traced rays through */
    /* The members below are of the running frame. */
    bool reads_sizes; /* the sizes of its lists are read, none is guessed */
    struct budget_use use;
    struct progress_span span; /* the part of the frame that rays report progress of */
    struct program_cache_stats urgent_programs; /* that urgent frames at its yield points used */
};

/* Creates what all frames of the context share. After a failure the caller calls finish. */
MUST_CHECK bool frame_context_init(struct frame_context *context, struct renderer *renderer,
                                   bool is_urgent, struct error *err);
void frame_context_finish(struct frame_context *context);

/* Empties its caches; if a frame runs, when that ends. */
void frame_context_forget(struct frame_context *context);
/* Ends a frame, and does what was put off while it ran. */
void frame_context_end_frame(struct frame_context *context);

/* The memory that counts against the budget: all of it, and the share of windows. */
uint64_t frame_context_size_bytes(const struct frame_context *context);
uint64_t frame_context_window_bytes(const struct frame_context *context);

/* The yield point of its frames; NULL: they never yield. */
const struct yield_point *frame_context_yield(const struct frame_context *context);

/* Reports progress of a frame that is not urgent. Thread: any. */
void frame_context_tell(const struct frame_context *context, enum frame_stage stage, double share);
/* Sets the part of the frame that is drawn from now on. */
void frame_context_begin_span(struct frame_context *context, struct progress_span span);

#endif

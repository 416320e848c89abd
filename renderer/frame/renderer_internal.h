/* SPDX-License-Identifier: MIT */
/* The renderer's parts, shared by the files of this folder only. */
#ifndef VITRAIL_RENDERER_FRAME_RENDERER_INTERNAL_H
#define VITRAIL_RENDERER_FRAME_RENDERER_INTERNAL_H

#include "renderer/frame/environment_cache.h"
#include "renderer/frame/frame_context.h"
#include "renderer/frame/frame_observations.h"
#include "renderer/frame/scene_cache.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/renderer.h"
#include "renderer/shading/readback.h"

struct frame_in_flight { /* zeroed: none (renderer/frame/frame_in_flight.h) */
    struct frame *frame;
    struct plan *plan; /* owned; of a strict renderer */
    double begin_ms;
    char scene_key[SCENE_KEY_BYTES]; /* and the view, borrowed: for making it again */
    const struct view *view;
    struct content_key pace_key, picture;
    struct frame_observation observation;
    bool is_cut; /* it has come, and must be made again */
};

/* Techniques that were timed while nobody asked: each once. Zeroed = none. */
enum { TIMED_VIEWS_MAX = 64 };
struct timed_view {
    uint64_t view; /* of struct learning_case */
    enum shadow_technique technique;
};
struct timed_views {
    struct timed_view views[TIMED_VIEWS_MAX]; /* a ring */
    int next;
};

/* The exposures that were metered last. Zeroed = none: no key is zero. */
enum { METER_READINGS_MAX = 16 };
struct meter_readings {
    struct meter_reading {
        struct content_key key;
        float ev;
    } items[METER_READINGS_MAX]; /* a ring */
    int next;
};

struct renderer {
    struct gl_context *gl;
    struct program_cache *programs;
    struct program_store *program_store; /* NULL: none */
    struct gpu_timeline *timeline;
    struct readback *readback;
    struct shadow_system *shadows;
    struct scene_cache scenes;
    struct environment_cache environments;
    struct raytrace_cache *traced;       /* of the scene with the traced_key of a context */
    struct frame_context frames, urgent; /* the second is made when a frame first yields */
    struct frame_context *current;       /* of the next frame: `urgent` at a yield point */
    struct frame_in_flight in_flight;    /* of `frames` */
    uint64_t budget_bytes;
    const char *budget_source;  /* never freed */
    uint64_t shadow_most_bytes; /* of it, for shadow structures */
    struct auto_settings automatic;
    struct frame_observations *observations;
    struct timed_views timed;
    struct meter_readings readings;
    bool is_strict, redraws_surfaces;
    uint32_t loop_end; /* loop_probe_run */
    struct wide_floats_choice wide_floats;
    struct proofs *proofs;                     /* NULL: the self-test's own */
    bool is_measuring;                         /* what it draws is shown to nobody */
    const struct yield_point *yield;           /* borrowed; NULL: frames never yield */
    const struct frame_progress *progress;     /* borrowed; NULL: nobody listens */
    const struct frame_completion *completion; /* borrowed; NULL: none */
};

/* The context of the frame that runs. At a yield point, before any urgent frame was drawn, it is
 * still that of the frame that has yielded. */
struct frame_context *renderer_context(struct renderer *renderer);
/* The context of the next frame. The context of urgent frames is created by the first call at a
 * yield point. NULL with err. */
struct frame_context *renderer_next_context(struct renderer *renderer, struct error *err);
/* A frame has yielded, and goes on later: what it uses must stay. */
bool renderer_is_yielding(const struct renderer *renderer);

/* All but GL context, programs and proofs. */
void renderer_finish_parts(struct renderer *renderer);

/* Empties all caches of a scene, but leaves the scene itself. */
void renderer_forget_kept(struct renderer *renderer, const char *key);

/* Drops the ray tracer's structure when it is of this scene, or of any with NULL. */
void renderer_forget_traced(struct renderer *renderer, const char *key);

/* Makes room by evicting the least recently used scenes, but never those to keep. */
void renderer_evict_scenes(struct renderer *renderer, const char *const *keep, size_t keep_count);

/* Evicts the least recently used scene that is neither this one nor a part of it. False: there is
 * none. */
bool renderer_evict_oldest_other(struct renderer *renderer, const struct resident_scene *scene);

/* All memory that counts against the budget. */
uint64_t renderer_used_bytes(const struct renderer *renderer);

/* Publishes what was learned; choices go by it from now on. */
void renderer_publish_observations(struct renderer *renderer);

#endif

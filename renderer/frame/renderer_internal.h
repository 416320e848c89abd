/* SPDX-License-Identifier: MIT */
/* The renderer's parts, shared by the files of this folder only. */
#ifndef VITRAIL_RENDERER_FRAME_RENDERER_INTERNAL_H
#define VITRAIL_RENDERER_FRAME_RENDERER_INTERNAL_H

#include "renderer/frame/frame_lessons.h"
#include "renderer/frame/kept_picture.h"
#include "renderer/frame/kept_window.h"
#include "renderer/frame/scene_cache.h"
#include "renderer/overlay/feature_edges.h"
#include "renderer/plan/frame_plan.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/renderer.h"
#include "renderer/shading/aov.h"
#include "renderer/shading/readback.h"
#include "renderer/shading/shade.h"

struct kept_state { /* zeroed = none: of the last frame */
    struct content_key key, cut;
    struct scene_state state;
};

/* The scene as the view sees it: kept from the last frame, or evaluated. Valid until the next call.
 * NULL with err. */
const struct scene_state *kept_state_get(struct kept_state *kept, struct content_key key,
                                         const struct scene *scene, const struct view *view,
                                         bool *is_kept, struct error *err);
void kept_state_drop(struct kept_state *kept);

/* How the lights of the last frame fitted the budget of shadows (renderer/frame/light_batches.h).
 */
struct light_batches { /* zeroed: nothing is known */
    struct content_key key;
    size_t most;          /* structures at once; 0: all */
    uint64_t share_bytes; /* of the budget, for which that holds: a larger one is tried anew */
};

struct frame_flight { /* zeroed: none (renderer/frame/frame_flight.h) */
    struct frame *frame;
    struct plan *plan; /* owned; of a strict renderer */
    double begin_ms;
    char scene_key[SCENE_KEY_BYTES]; /* and the view, borrowed: for making it again */
    const struct view *view;
    struct content_key pace_key, picture;
    struct frame_lesson lesson;
    bool is_cut; /* it has come, and must be made again */
};

/* Of the frame that runs (renderer/frame/frame_budget.h). */
struct budget_use {
    const struct resident_scene *scene; /* NULL: no frame runs */
    bool has_windows, has_rays; /* what is kept of windows, and of the ray tracer, is in use */
    bool forgets_later;         /* renderer_forget_kept, when it ends */
    uint64_t shadow_bytes;      /* the share of shadow structures */
};

/* Techniques that were timed while nobody asked: each once. Zeroed = none. */
enum { TIMED_VIEWS_MAX = 64 };
struct timed_view {
    uint64_t view; /* of struct learning_case */
    enum forecast_technique technique;
};
struct timed_views {
    struct timed_view views[TIMED_VIEWS_MAX]; /* a ring */
    int next;
};

struct renderer {
    struct renderer *other; /* makes frames while one is paused, and back; NULL: not made yet */
    bool is_beside;         /* it is the other of one that was created before it */
    struct gl_context *context;
    struct program_cache *programs;
    struct program_store *program_store; /* NULL: none */
    struct gpu_timeline *timeline;
    struct readback *readback;
    struct draw_arena *arena;
    struct frame_textures *textures; /* of the frame that runs, or NULL */
    struct light_lists *lists;
    struct shadow_system *shadows;
    struct plan_cache plans;
    struct kept_state kept_state;
    struct light_batches batches;
    struct targets targets;
    struct kept_window kept; /* of targets and pixels */
    struct kept_picture kept_picture;
    struct pixel_lists pixels;
    struct list_history list_history;
    struct band_history band_history;
    bool reads_sizes; /* of the lists of the frame that runs: none is guessed */
    struct shade shade;
    struct aov aov;
    struct scene_cache own_scenes, *scenes; /* of the two together */
    struct raytrace_cache *traced;          /* of the scene with traced_key */
    struct traced_shadows shadow_rays;
    struct feature_edges feature_edges; /* of the last scene that they were drawn of */
    char traced_key[SCENE_KEY_BYTES];
    uint64_t budget_bytes;
    const char *budget_source;  /* never freed */
    uint64_t shadow_most_bytes; /* of it, for shadow structures */
    struct budget_use use;
    struct auto_settings automatic;
    struct frame_lessons *lessons; /* not of one beside */
    struct timed_views timed;
    bool is_strict, redraws_surfaces;
    uint32_t loop_end; /* loop_probe_run */
    struct wide_floats_choice wide_floats;
    struct proofs *proofs;                 /* of the two together; NULL: the self-test's own */
    bool is_measuring;                     /* what it draws is shown to nobody */
    const struct interlude *interlude;     /* borrowed; NULL: frames are made in one piece */
    const struct frame_progress *progress; /* borrowed; NULL: nobody listens */
    struct frame_piece piece;              /* what rays tell their share of */
    bool is_paused;                        /* its frame is: others go to `other` */
    struct frame_flight flight;            /* not of one beside */
    const struct frame_arrival *arrival;   /* borrowed; NULL: none */
    struct program_cache_stats aside;      /* what others did while the frame was paused */
};

/* What frames hold, of this renderer alone. */
MUST_CHECK bool renderer_create_own(struct renderer *renderer, struct error *err);
/* All but context, programs and proofs. */
void renderer_finish_parts(struct renderer *renderer);

/* One that shares the context, programs, scenes and shadow structures of another. NULL with err. */
struct renderer *renderer_create_beside(struct renderer *renderer, struct error *err);

/* Drops all that is kept of a scene between its frames, but the scene. */
void renderer_forget_kept(struct renderer *renderer, const char *key);

/* Drops the ray tracer's structure when it is of this scene, or of any with NULL. */
void renderer_forget_traced(struct renderer *renderer, const char *key);

/* Makes room by forgetting scenes that were not used for longest; never those to keep. */
void renderer_evict_scenes(struct renderer *renderer, const char *const *keep, size_t keep_count);

/* The scene used longest ago that is neither this one nor a part of it. False: there is none. */
bool renderer_evict_oldest_beside(struct renderer *renderer, const struct resident_scene *scene);

/* What counts against the budget: of all; and of what windows of this renderer hold. */
uint64_t renderer_used_bytes(const struct renderer *renderer);
uint64_t renderer_window_bytes(const struct renderer *renderer);

/* Choices go by what is due from now on. Nothing while a frame runs. */
void renderer_publish_lessons(struct renderer *renderer);

/* Tells of the frame; not of one beside. Thread: any. */
void renderer_tell(const struct renderer *renderer, enum frame_stage stage, double share);
/* What is made from now on. */
void renderer_begin_piece(struct renderer *renderer, struct frame_piece piece);

/* Does what was put off while a frame ran. */
void renderer_end_frame(struct renderer *renderer);

#endif

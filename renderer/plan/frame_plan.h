/* SPDX-License-Identifier: MIT */
/* A plan with what it was decided from: the drawables in view, the lights that matter, and what
 * each would cast shadows of. The executor draws these, so that it decides nothing again. Plans are
 * kept by their key. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_PLAN_FRAME_PLAN_H
#define VITRAIL_RENDERER_PLAN_FRAME_PLAN_H

#include "renderer/base/content_key.h"
#include "renderer/draw/shader_needs.h"
#include "renderer/lights/light_reach.h"
#include "renderer/plan/plan.h"
#include "renderer/shadows/shadow_needs.h"
#include "renderer/window/geometry.h"

/* Zeroed = empty. Indices are those of the state that it was made from, or of an equal one. */
struct frame_plan {
    struct plan plan;
    struct geometry_items items; /* in view */
    struct light_reach reach;    /* empty where no light list is needed */
    struct shadow_needs shadows; /* empty without colour */
    struct shader_needs shaders; /* of the scene's state */
};

struct frame_plan_desc {
    const struct view *view;         /* required; outputs not 0 */
    const struct scene_state *state; /* required */
    const struct camera *camera;     /* required */
    const struct gl_limits *limits;  /* required */
    struct light_reach *reach; /* found already, and taken over; NULL or empty: it is found here */
    uint64_t shadow_budget_bytes; /* of all shadow structures */
    uint64_t depths_bytes;        /* that depths of density grids may take */
    bool sees_all; /* every drawable and light counts as seen, as some other camera may see them:
                      for what may be asked of a scene, not for frames */
};

/* A plan for a frame that finds nothing kept from before. What one with kept structures leaves out
 * of it is in its report's `reused`. */
MUST_CHECK bool frame_plan_init(struct frame_plan *plan, const struct frame_plan_desc *desc,
                                struct error *err);
void frame_plan_finish(struct frame_plan *plan);

enum { PLAN_CACHE_ENTRIES = 8 };

struct plan_cache_entry {
    struct content_key key;
    struct frame_plan plan;
    uint64_t last_use, size_bytes;
};

struct plan_cache { /* zeroed = empty */
    struct plan_cache_entry entries[PLAN_CACHE_ENTRIES];
    uint64_t clock, hits, misses;
};

/* The plan under its key, made where it is absent; valid until the next call. NULL with err. */
const struct frame_plan *plan_cache_get(struct plan_cache *cache, struct content_key key,
                                        const struct frame_plan_desc *desc, struct error *err);
/* Forgets all plans: a scene's key may mean something else from now on. */
void plan_cache_clear(struct plan_cache *cache);

#endif

/* SPDX-License-Identifier: MIT */
/* The renderer's parts, shared by renderer.c and frame.c only. */
#ifndef VITRAIL_RENDERER_RENDERER_INTERNAL_H
#define VITRAIL_RENDERER_RENDERER_INTERNAL_H

#include "renderer/plan/frame_plan.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/renderer.h"
#include "renderer/scene_cache.h"
#include "renderer/shading/aov.h"
#include "renderer/shading/shade.h"

struct renderer {
    struct gl_context *context;
    struct program_cache *programs;
    struct gpu_timeline *timeline;
    struct draw_arena *arena;
    struct light_lists *lists;
    struct shadow_system *shadows;
    struct plan_cache plans;
    struct targets targets;
    struct pixel_lists pixels;
    struct shade shade;
    struct aov aov;
    struct scene_cache scenes;
    struct raytrace_cache *traced; /* of the scene with traced_key */
    char traced_key[SCENE_KEY_BYTES];
    uint64_t budget_bytes;
    bool is_strict;
};

/* Drops all that is kept of a scene between its frames, but the scene. */
void renderer_forget_kept(struct renderer *renderer, const char *key);

/* Drops the ray tracer's structure when it is of this scene, or of any with NULL. */
void renderer_forget_traced(struct renderer *renderer, const char *key);

uint64_t renderer_used_bytes(const struct renderer *renderer);

#endif

/* SPDX-License-Identifier: MIT */
/* Geometry and textures of a scene on the GPU, and the one way to draw them. Thread: GL. */
#ifndef VITRAIL_RENDERER_SCENE_SCENE_GPU_H
#define VITRAIL_RENDERER_SCENE_SCENE_GPU_H

#include "renderer/gl/object.h"
#include "renderer/gl/program.h"
#include "renderer/scene/scene_state.h"

struct scene_gpu;

struct scene_gpu *scene_gpu_create(const struct scene *scene, struct error *err);
void scene_gpu_destroy(struct scene_gpu *gpu);
uint64_t scene_gpu_size_bytes(const struct scene_gpu *gpu);
/* Of a base colour texture, in [0, 1]: no filter of it samples less. 1 for -1 or a missing image.
 */
float scene_gpu_least_alpha(const struct scene_gpu *gpu, int32_t texture);

/* Per-frame store of draw and material records. */
struct draw_arena;
struct draw_arena *draw_arena_create(struct error *err);
void draw_arena_destroy(struct draw_arena *arena);
/* Starts a frame: forgets all draws, uploads the material records of `state` (BIND_MATERIALS). */
MUST_CHECK bool draw_arena_begin(struct draw_arena *arena, const struct scene_state *state,
                                 struct error *err);
/* For passes without draws that read materials. */
void draw_arena_bind_materials(const struct draw_arena *arena);

/* Which programs a submission needs: for each item the caller's hook returns the program, so that
 * variants by material are possible; consecutive items with one program are not re-bound. */
struct draw_desc {
    const struct scene_gpu *gpu;     /* required */
    const struct scene_state *state; /* required */
    struct draw_arena *arena;        /* required */
    const uint32_t *items;           /* required; indices of state->items */
    size_t item_count;
    double origin[3];     /* draw_record positions are world - origin */
    bool cull_back_faces; /* of single-sided materials that are not media; camera passes do, light
                             passes do not */
    bool needs_textures;  /* bind the material's textures to UNIT_MATERIAL_0.. */
    const struct gl_program *(*program_for)(void *context, const struct state_item *item,
                                            struct error *err);
    void *context; /* for program_for */
};
struct draw_counts {
    uint64_t draws, triangles;
};
/* Vertex attributes: 0 position, 1 normal, 2 tangent, 3 texcoord 0, 4 texcoord 1, 5 color. The draw
 * record's index is gl_BaseInstanceARB (shaders/draw.glsl). Adds to *counts when not NULL. */
MUST_CHECK bool draws_submit(const struct draw_desc *desc, struct draw_counts *counts,
                             struct error *err);

#endif

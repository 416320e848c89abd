/* SPDX-License-Identifier: MIT */
/* Geometry and textures of a scene on the GPU, and the one way to draw them. Thread: GL. */
#ifndef VITRAIL_RENDERER_DRAW_SCENE_GPU_H
#define VITRAIL_RENDERER_DRAW_SCENE_GPU_H

#include "renderer/gl/object.h"
#include "renderer/gl/program.h"
#include "renderer/scene/scene_state.h"
#include "renderer/textures/texture_need.h"
#include "renderer/textures/texture_store.h"

struct scene_gpu;

/* Its images join those of the pool, which must outlive it (renderer/textures/texture_store.h). */
struct scene_gpu *scene_gpu_create(const struct scene *scene, struct texture_pool *textures,
                                   struct error *err);
/* Of a composed scene (renderer/scene/compose.h): uploads nothing, but borrows what its parts have
 * on the GPU, which must outlive it. sources: by part of the scene, the base first; no composed
 * ones. */
struct scene_gpu *scene_gpu_compose(const struct scene *scene,
                                    const struct scene_gpu *const *sources, struct error *err);
void scene_gpu_destroy(struct scene_gpu *gpu);
uint64_t scene_gpu_size_bytes(const struct scene_gpu *gpu); /* at present, textures too */
/* 1 but for a composed scene. Parts of one scene are the same: the first one like a part is itself
 * or one before it. */
uint32_t scene_gpu_part_count(const struct scene_gpu *gpu);
uint32_t scene_gpu_first_like(const struct scene_gpu *gpu, uint32_t part);
struct texture_store *scene_gpu_textures(const struct scene_gpu *gpu, uint32_t part);
struct texture_density *scene_gpu_texture_density(const struct scene_gpu *gpu);

/* Per pass, the camera's first, then one of each light: per texture_key the finest level that it
 * can need (renderer/textures/texture_need.h), or TEXTURE_UNNEEDED; a pass may be NULL. */
struct texture_passes {
    uint8_t **levels;
    size_t count;
};
/* Borrowed until NULL is set: what the passes of a frame sample is what they say, whatever finer
 * levels are resident. */
void scene_gpu_set_texture_passes(struct scene_gpu *gpu, const struct texture_passes *passes);

/* The least alpha of a base colour texture, in [0, 1]: no filter samples less. 1 for -1 or a
 * missing image. */
float scene_gpu_least_alpha(const struct scene_gpu *gpu, int32_t texture);

/* MATERIAL_* of a material's record, but those that depend on the item. */
uint32_t material_flags(const struct state_material *material);

/* Per-frame store of draw and material records. */
struct draw_arena;
struct draw_arena *draw_arena_create(const struct gl_limits *limits, struct error *err);
void draw_arena_destroy(struct draw_arena *arena);
/* Starts a frame: forgets all draws, uploads the material records of `state` (BIND_MATERIALS). */
MUST_CHECK bool draw_arena_begin(struct draw_arena *arena, const struct scene_state *state,
                                 struct error *err);
/* Binds the materials for passes that read them but draw nothing. */
void draw_arena_bind_materials(const struct draw_arena *arena);

/* The space that records are relative to. The matrices of a record are products in f64, rounded
 * once: a scene that is moved, turned or scaled together with its camera and lights has the same
 * ones. */
struct draw_space {
    double origin[3];  /* world */
    double axes[3][3]; /* rows of space_from_world, orthonormal */
    double unit_m;     /* > 0 */
};
struct draw_place_desc {
    const struct scene_state *state; /* required */
    const uint32_t *items;           /* required; indices of state->items */
    size_t item_count;
    struct draw_space space;
};
struct draw_placement { /* zeroed = none yet */
    uint64_t epoch;
    uint32_t first_record; /* of items[0]; those of the other items follow */
};
/* Index of the item's record among the materials that the arena has on the GPU. */
uint32_t draw_arena_material(const struct draw_arena *arena, uint32_t item);

/* Puts one draw record per item on the GPU, to be drawn from by any number of submissions. Records
 * are let go when too many have come, and at the end of the frame: call this before each
 * submission; it does nothing while the placement holds, or when the same items were placed in the
 * same space in the call before. */
MUST_CHECK bool draw_arena_place(struct draw_arena *arena, const struct draw_place_desc *desc,
                                 struct draw_placement *placement, struct error *err);
/* The same for several placements, which then hold together. All that they lack is uploaded at
 * once. */
MUST_CHECK bool draw_arena_place_all(struct draw_arena *arena, const struct draw_place_desc *descs,
                                     struct draw_placement *const *placements, size_t count,
                                     struct error *err);

/* Whether all records fit into one storage block, as instances of faces need it. */
bool draw_arena_has_block(const struct draw_arena *arena);

struct draw_choice {                  /* how an item is drawn */
    const struct gl_program *program; /* required */
    bool samples_textures;
    size_t texture_pass; /* of struct texture_passes; 0 is the camera's */
};
struct draw_desc {
    const struct scene_gpu *gpu;     /* required */
    const struct scene_state *state; /* required */
    struct draw_arena *arena;        /* required */
    const uint32_t *items;           /* required; indices of state->items */
    const uint32_t *records;         /* required; the record of each item */
    /* Per item the face that it is drawn for, by programs that read ATTRIBUTE_INSTANCE: items are
     * then drawn in the order of their states. NULL: in their own order, by programs that read
     * records as attributes. */
    const uint32_t *faces;
    size_t item_count;
    /* Of single-sided materials that are not media; camera passes do, light passes do not. */
    bool cull_back_faces;
    /* Required. Fills *choice, which comes in zeroed, for items[index]. Called for all items before
     * the first is drawn: set a program's uniforms when it is first chosen. */
    bool (*choose)(void *context, size_t index, struct draw_choice *choice, struct error *err);
    void *context; /* for choose */
};
struct draw_counts {
    uint64_t draws; /* items */
    uint64_t calls; /* of the GL: one for consecutive items of one state */
    uint64_t triangles;
};
/* Vertex attributes: 0 position, 1 normal, 2 tangent, 3 texcoord 0, 4 texcoord 1, 5 color, and from
 * ATTRIBUTE_DRAW on the draw record, one per instance (shaders/draw/draw.glsl). Textures of the
 * material are at UNIT_MATERIAL_0.. where the hook asked for them. Adds to *counts when not NULL.
 */
MUST_CHECK bool draws_submit(const struct draw_desc *desc, struct draw_counts *counts,
                             struct error *err);

/* The same in steps, so that several lists go up together: draws_begin, draws_add for each list,
 * draws_upload, draws_run for each list, draws_end. Between the last three other draws may come in
 * after a draws_end; state that a list needs besides is the caller's. */
struct draw_range { /* a list of the arena */
    uint32_t first, count;
};
void draws_begin(struct draw_arena *arena);
MUST_CHECK bool draws_add(const struct draw_desc *desc, struct draw_range *range,
                          struct error *err);
MUST_CHECK bool draws_upload(struct draw_arena *arena, struct error *err);
/* Draws the range. Of desc only gpu, state and arena are used. */
void draws_run(const struct draw_desc *desc, const struct draw_range *range);
void draws_end(struct draw_arena *arena);
/* Appends an instance to the list in the making, for draws without items. Returns its number. */
MUST_CHECK bool draws_add_instance(struct draw_arena *arena, uint32_t record, uint32_t face,
                                   uint32_t *number, struct error *err);
/* Gives an array of another's the attribute ATTRIBUTE_INSTANCE, and attaches what was uploaded, or
 * nothing. */
void draws_format_instances(const struct gl_vertex_array *array);
void draws_bind_instances(const struct draw_arena *arena, const struct gl_vertex_array *array,
                          bool is_on);

#endif

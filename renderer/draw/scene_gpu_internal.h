/* SPDX-License-Identifier: MIT */
/* Shared by scene_gpu.c (upload), scene_geometry.c (of vertices), draw_arena.c (records) and
 * draws.c (submission). Thread: GL. */
#ifndef VITRAIL_RENDERER_DRAW_SCENE_GPU_INTERNAL_H
#define VITRAIL_RENDERER_DRAW_SCENE_GPU_INTERNAL_H

#include "renderer/draw/scene_gpu.h"
#include "renderer/draw/vertex_layout.h"
#include "renderer/gl/stream.h"

/* Vertices and indices of a scene. Zeroed = none. */
struct scene_geometry {
    struct vertex_layout layout;
    struct gl_buffer streams[VERTEX_STREAM_COUNT]; /* unnamed where no vertex has it */
    struct gl_buffer indices;
    /* By the set of optional streams that they read; the others give their neutral element. Unnamed
     * where the set has a stream that the scene lacks. */
    struct gl_vertex_array arrays[VERTEX_OPTIONALS + 1];
    /* The same for vertices in a pose, which bring positions, normals and tangents of their own:
     * deform_gpu_bind. Unnamed where nothing deforms. */
    struct gl_vertex_array deformed[VERTEX_OPTIONALS + 1];
    uint64_t size_bytes;
};

MUST_CHECK bool scene_geometry_init(struct scene_geometry *geometry, const struct scene *scene,
                                    struct error *err);
void scene_geometry_finish(struct scene_geometry *geometry);

/* Which array a program that reads these attributes (bits by location) draws a primitive of these
 * flags from: equal for as many primitives as can be. */
static inline uint32_t scene_geometry_array(const struct scene_geometry *geometry,
                                            uint32_t attributes, uint32_t flags)
{
    return geometry->layout.optionals & (flags | ~(attributes >> VERTEX_TANGENT));
}

struct scene_gpu {
    const struct scene *scene;
    struct scene_geometry geometry;
    struct texture_store *textures;
    struct texture_density *density;
    const struct texture_passes *passes; /* of the frame; NULL: what is resident is sampled */
    struct gl_sampler *samplers;         /* per texture */
    struct gl_texture white;
    uint32_t *texture_classes; /* per material: equal where all textures are the same */
    /* Of a composed scene, by part: whose vertices are drawn. Samplers are borrowed from them,
     * and textures are theirs. NULL: none. */
    const struct scene_gpu **parts;
    uint32_t part_count;
};

struct cap_gpu { /* the caps of the frame's state; the array is unnamed without */
    struct gl_buffer positions, normals, indices;
    struct gl_vertex_array array;
    uint64_t serial; /* of struct state_caps */
};

struct deform_range { /* of vertices that are on the device */
    struct content_key pose;
    uint64_t scene_serial;
    uint32_t primitive, first_vertex, vertex_count;
};

struct deform_gpu {              /* the poses of the frame's state */
    struct gl_buffer streams[3]; /* positions, normals, tangents */
    struct deform_range *ranges; /* owned; by item of the state_deforms uploaded last */
    size_t count;
    uint64_t serial; /* of them */
};
/* Uploads the ranges whose vertices are others than before. */
MUST_CHECK bool deform_gpu_upload(struct deform_gpu *gpu, const struct state_deforms *deforms,
                                  struct error *err);
void deform_gpu_finish(struct deform_gpu *gpu);
/* The array of a primitive of these flags in a pose. */
uint32_t deform_gpu_array(const struct scene_geometry *geometry, uint32_t flags);
/* Has an array of deform_gpu_array read a primitive: first_posed is its first vertex among those in
 * a pose, first_at_rest among those of the scene. NULL for gpu: has it let go the former. */
void deform_gpu_bind(const struct deform_gpu *gpu, const struct scene_geometry *geometry,
                     uint32_t array, uint32_t first_posed, uint32_t first_at_rest);

/* Draw records as attributes of the array, from a buffer that each submission binds. */
void scene_gpu_format_records(uint32_t array); /* and instances */
void scene_gpu_format_instances(uint32_t array);

struct draw_record;
struct draw_batch;
struct draw_entry;

/* The bindings of the buffers of records and of instances in vertex arrays. */
enum { BINDING_RECORDS = 6, BINDING_INSTANCES };

struct draw_instance { /* ATTRIBUTE_INSTANCE */
    uint32_t record, face;
};

struct draw_bound { /* of the GL, as draws left it */
    const struct gl_program *program;
    uint32_t vertices; /* the array, 0 for none */
    uint32_t deformed; /* 1 + the item whose pose it reads; 0: none */
    bool culls_back, is_mirrored;
};

struct draw_command { /* OpenGL 4.5 core profile, 10.4, DrawElementsIndirectCommand */
    uint32_t index_count, instance_count, first_index;
    int32_t base_vertex;
    uint32_t base_instance;
};

struct draw_arena {
    const struct gl_limits *limits;
    struct gl_buffer draws, materials;
    uint64_t material_bytes; /* of the frame's */
    struct gl_stream commands, instances;
    struct cap_gpu caps;
    struct deform_gpu deforms;
    uint32_t *item_materials;    /* per item of the state: index of its material record */
    struct draw_record *records; /* of the placement in the making */
    uint32_t *placed;            /* items of the last placement ... */
    struct draw_space placed_space;
    size_t placed_count, record_capacity;
    struct draw_placement placement;
    size_t used;    /* records on the GPU, of this epoch */
    uint64_t epoch; /* counts how often all of them were let go */
    /* of the lists in the making, and of those uploaded last: */
    struct draw_command *command_list;
    struct draw_batch *batches;
    struct draw_instance *instance_list;
    struct draw_entry *entries; /* of the list in the making */
    size_t command_count, command_capacity, batch_count, batch_capacity;
    size_t instance_count, instance_capacity, entry_capacity;
    uint64_t commands_offset, instances_offset; /* bytes in the streams */
    struct draw_bound bound;
};

/* The scene whose vertex arrays hold the primitive's vertices. */
static inline const struct scene_gpu *scene_gpu_of_part(const struct scene_gpu *gpu, uint32_t part)
{
    return gpu->part_count ? gpu->parts[part] : gpu;
}

struct texture_binding {
    int slot;
    int32_t texture; /* -1: white */
    uint32_t unit;
    size_t pass; /* of struct texture_passes */
};
/* Whether two passes sample the same levels of all textures of a material. */
bool scene_gpu_samples_alike(const struct scene_gpu *gpu, const struct scene_material *material,
                             size_t pass, size_t other);
/* Binds the texture with its sampler, in the colour space of the slot. */
void scene_gpu_bind_texture(const struct scene_gpu *gpu, const struct texture_binding *binding);

#endif

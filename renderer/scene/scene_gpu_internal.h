/* SPDX-License-Identifier: MIT */
/* Shared by scene_gpu.c (upload) and draws.c (submission). Thread: GL. */
#ifndef VITRAIL_RENDERER_SCENE_SCENE_GPU_INTERNAL_H
#define VITRAIL_RENDERER_SCENE_SCENE_GPU_INTERNAL_H

#include "renderer/scene/scene_gpu.h"

enum { SCENE_GPU_STREAMS = 6 }; /* position, normal, tangent, texcoord 0, texcoord 1, color */

struct scene_gpu {
    const struct scene *scene;
    struct gl_buffer streams[SCENE_GPU_STREAMS]; /* unnamed where the scene has no such attribute */
    struct gl_buffer indices;
    struct gl_vertex_array vertex_array;
    struct gl_texture *images;   /* [2 * image + is_srgb]; unnamed where unused */
    uint8_t *least_alpha;        /* per image, of those sampled as base colours; else 0 */
    struct gl_sampler *samplers; /* per texture */
    struct gl_texture white;
    uint64_t size_bytes;
};

/* Binds texture (or white for -1) with its sampler, in the colour space of the slot. */
void scene_gpu_bind_texture(const struct scene_gpu *gpu, int slot, int32_t texture, uint32_t unit);

#endif

/* SPDX-License-Identifier: MIT */
/* Scenes resident on the GPU, least recently used first out. Thread: GL. */
#ifndef VITRAIL_RENDERER_SCENE_CACHE_H
#define VITRAIL_RENDERER_SCENE_CACHE_H

#include "renderer/renderer.h"
#include "renderer/scene/scene_gpu.h"

enum { SCENE_KEY_BYTES = 65 };

struct resident_scene {
    char key[SCENE_KEY_BYTES];
    struct scene scene;
    struct scene_gpu *gpu;
    void (*release)(void *context);
    void *context;
    uint64_t last_use;
    bool is_pinned; /* a frame of it is paused */
};

struct scene_cache {
    struct resident_scene **entries;
    size_t count, capacity;
    uint64_t clock, texture_budget_bytes; /* of each scene */
};

/* NULL when absent; marks the scene as used. */
struct resident_scene *scene_cache_find(struct scene_cache *cache, const char *key);
MUST_CHECK bool scene_cache_add(struct scene_cache *cache, const struct renderer_scene_desc *desc,
                                struct error *err);
void scene_cache_remove(struct scene_cache *cache, const char *key);
/* Key of the least recently used scene other than `keep` that is not pinned, or NULL. */
const char *scene_cache_oldest(const struct scene_cache *cache, const char *keep);
uint64_t scene_cache_size_bytes(const struct scene_cache *cache);
uint64_t scene_cache_texture_bytes(const struct scene_cache *cache); /* of those, textures */
void scene_cache_finish(struct scene_cache *cache);

#endif

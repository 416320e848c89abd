/* SPDX-License-Identifier: MIT */
/* Scenes resident on the GPU, least recently used first out. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_SCENE_CACHE_H
#define VITRAIL_RENDERER_FRAME_SCENE_CACHE_H

#include "renderer/draw/scene_gpu.h"
#include "renderer/renderer.h"
#include "renderer/scene/compose.h"

enum { SCENE_KEY_BYTES = 65 };

struct resident_scene {
    char key[SCENE_KEY_BYTES];
    struct scene scene;
    struct scene_gpu *gpu;
    void (*release)(void *context);
    void *context;
    uint64_t last_use;
    bool is_pinned; /* a frame of it is paused */
    /* The members of a composed scene, owned; else NULL and 0. */
    struct composed_scene *composed;
    struct resident_scene **sources; /* owned array of others of the cache, the base first */
    size_t source_count;
};

/* The key under which a scene's shadows are kept: with parts it is that of the base, whose casters
 * have the same shadows then. */
static inline const char *resident_scene_shadow_key(const struct resident_scene *scene)
{
    return scene->source_count ? scene->sources[0]->key : scene->key;
}

struct scene_cache {
    struct resident_scene **entries;
    size_t count, capacity;
    uint64_t clock;
    struct texture_pool *textures; /* of all scenes; owned */
};

/* NULL when absent; marks the scene as used. */
struct resident_scene *scene_cache_find(struct scene_cache *cache, const char *key);
MUST_CHECK bool scene_cache_add(struct scene_cache *cache, const struct renderer_scene_desc *desc,
                                struct error *err);
void scene_cache_remove(struct scene_cache *cache, const char *key);
/* Key of the least recently used scene that is neither composed nor pinned nor among `keep`, or
 * NULL. */
const char *scene_cache_oldest(const struct scene_cache *cache, const char *const *keep,
                               size_t keep_count);

/* Composed scenes take no memory of the GPU. */
struct scene_cache_composed { /* all required; composed and gpu are taken on success */
    const char *key;
    struct composed_scene *composed;
    struct scene_gpu *gpu;
    struct resident_scene *const *sources; /* copied */
    size_t source_count;
};
MUST_CHECK bool scene_cache_add_composed(struct scene_cache *cache,
                                         const struct scene_cache_composed *desc,
                                         struct error *err);
size_t scene_cache_count_composed(const struct scene_cache *cache);
const char *scene_cache_oldest_composed(const struct scene_cache *cache); /* NULL: none */
/* Key of a composed scene that has the scene among its sources, or NULL. */
const char *scene_cache_user(const struct scene_cache *cache, const char *key);
uint64_t scene_cache_size_bytes(const struct scene_cache *cache);
void scene_cache_finish(struct scene_cache *cache);

#endif

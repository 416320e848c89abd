/* SPDX-License-Identifier: MIT */
/* Composed scenes: made when a view first asks for them, known by what they consist of. Where their
 * parts are placed is the view's, so a part that moves composes nothing. */
#include "renderer/frame/scene_parts.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COMPOSED_MAX = 8 }; /* tables only; a view at work has one */

/* 64-bit of a scene's key, never 0. */
static uint64_t identity_of(const char *scene_key)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, scene_key);
    return key.words[0] | 1;
}

static void key_of(const char *scene_key, const struct view *view, char key[SCENE_KEY_BYTES])
{
    struct content_key content = content_key_begin();
    content_key_add_text(&content, scene_key);
    for (size_t i = 0; i < view->part_count; i++) {
        content_key_add_text(&content, view->parts[i].name);
        content_key_add_text(&content, view->parts[i].scene_key);
        content_key_add_text(&content, view->parts[i].parent);
    }
    snprintf(key, SCENE_KEY_BYTES, "parts %016" PRIx64 "%016" PRIx64, content.words[0],
             content.words[1]);
}

static bool find_source(struct scene_cache *cache, const char *key, struct resident_scene **found,
                        struct error *err)
{
    *found = scene_cache_find(cache, key);
    return *found || error_set(err, ERROR_NOT_FOUND, "scene '%.64s' is not on the GPU", key);
}

/* Finds the sources of a composed scene: the base first, then one per part of the view. */
static bool find_sources(struct scene_cache *cache, const char *scene_key, const struct view *view,
                         struct resident_scene **sources, struct error *err)
{
    bool is_good = find_source(cache, scene_key, &sources[0], err);
    for (size_t i = 0; is_good && i < view->part_count; i++)
        is_good = find_source(cache, view->parts[i].scene_key, &sources[i + 1], err);
    return is_good;
}

static struct composed_scene *compose(struct resident_scene *const *sources,
                                      const struct view *view, struct error *err)
{
    struct compose_part *parts = calloc(view->part_count, sizeof *parts);
    if (!parts) {
        error_set(err, ERROR_NO_MEMORY, "%zu parts", view->part_count);
        return NULL;
    }
    for (size_t i = 0; i < view->part_count; i++)
        parts[i] = (struct compose_part){.name = view->parts[i].name,
                                         .scene = &sources[i + 1]->scene,
                                         .parent = view->parts[i].parent,
                                         .identity = identity_of(view->parts[i].scene_key)};
    struct composed_scene *composed = scene_compose(
        &(struct compose_desc){
            .base = &sources[0]->scene, .parts = parts, .part_count = view->part_count},
        err);
    free(parts);
    return composed;
}

/* Parts may come in another order than those of the view: deeper ones later. */
static struct scene_gpu *compose_gpu(struct resident_scene *const *sources,
                                     const struct scene *scene, struct error *err)
{
    const struct scene_gpu **gpus = calloc(scene->part_count, sizeof *gpus);
    if (!gpus) {
        error_set(err, ERROR_NO_MEMORY, "%u parts", scene->part_count);
        return NULL;
    }
    gpus[0] = sources[0]->gpu;
    for (uint32_t i = 1; i < scene->part_count; i++)
        gpus[i] = sources[scene->parts[i].source_index + 1]->gpu;
    struct scene_gpu *gpu = scene_gpu_compose(scene, gpus, err);
    free(gpus);
    return gpu;
}

static struct resident_scene *add(struct renderer *renderer, const char *key,
                                  struct resident_scene *const *sources, const struct view *view,
                                  struct error *err)
{
    struct scene_cache_composed desc = {
        .key = key, .sources = sources, .source_count = view->part_count + 1};
    desc.composed = compose(sources, view, err);
    if (!desc.composed)
        return NULL;
    desc.gpu = compose_gpu(sources, composed_scene_get(desc.composed), err);
    if (desc.gpu && scene_cache_add_composed(&renderer->scenes, &desc, err))
        return scene_cache_find(&renderer->scenes, key);
    scene_gpu_destroy(desc.gpu);
    composed_scene_destroy(desc.composed);
    return NULL;
}

/* Nothing goes while a frame is paused: it may show what is the oldest here. */
static void make_room(struct renderer *renderer)
{
    if (renderer_is_yielding(renderer))
        return;
    while (scene_cache_count_composed(&renderer->scenes) >= COMPOSED_MAX)
        renderer_remove_scene(renderer, scene_cache_oldest_composed(&renderer->scenes));
}

struct resident_scene *renderer_find_scene(struct renderer *renderer, const char *scene_key,
                                           const struct view *view, struct error *err)
{
    char key[SCENE_KEY_BYTES];
    struct resident_scene *found = NULL;
    if (!view->part_count) {
        if (!find_source(&renderer->scenes, scene_key, &found, err))
            return NULL;
        return found;
    }
    struct resident_scene **sources = calloc(view->part_count + 1, sizeof(*sources));
    if (!sources) {
        error_set(err, ERROR_NO_MEMORY, "%zu parts", view->part_count);
        return NULL;
    }
    key_of(scene_key, view, key);
    if (find_sources(&renderer->scenes, scene_key, view, sources, err)) { /* marks them as used */
        found = scene_cache_find(&renderer->scenes, key);
        if (!found) {
            make_room(renderer);
            found = add(renderer, key, sources, view, err);
        }
    }
    free(sources);
    return found;
}

void renderer_remove_scene(struct renderer *renderer, const char *key)
{
    char name[SCENE_KEY_BYTES]; /* key may be the entry's own */
    snprintf(name, sizeof name, "%s", key);
    for (const char *user; (user = scene_cache_user(&renderer->scenes, name));)
        renderer_remove_scene(renderer, user);
    renderer_forget_kept(renderer, name);
    shadow_system_trim(renderer->shadows);
    scene_cache_remove(&renderer->scenes, name);
}

const struct scene *renderer_get_scene(struct renderer *renderer, const char *scene_key,
                                       const struct view *view, struct error *err)
{
    const struct resident_scene *found = renderer_find_scene(renderer, scene_key, view, err);
    return found ? &found->scene : NULL;
}

/* The scenes that the view's own consists of; the caller frees them. NULL without memory. */
static const char **source_keys(const struct resident_scene *scene, size_t *count)
{
    const char **keys = calloc(scene->source_count + 1, sizeof *keys);
    *count = scene->source_count ? scene->source_count : 1;
    for (size_t i = 0; keys && i < *count; i++)
        keys[i] = scene->source_count ? scene->sources[i]->key : scene->key;
    return keys;
}

void renderer_evict_others(struct renderer *renderer, const struct resident_scene *scene)
{
    size_t count;
    const char **keys = source_keys(scene, &count);
    if (keys) /* without memory for it, room is made the next time */
        renderer_evict_scenes(renderer, keys, count);
    free(keys);
}

bool renderer_evict_oldest_other(struct renderer *renderer, const struct resident_scene *scene)
{
    size_t count;
    const char **keys = source_keys(scene, &count);
    const char *oldest = keys ? scene_cache_oldest(&renderer->scenes, keys, count) : NULL;
    free(keys);
    if (oldest)
        renderer_remove_scene(renderer, oldest);
    return oldest != NULL;
}

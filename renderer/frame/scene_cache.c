/* SPDX-License-Identifier: MIT */
/* The GPU side of the scene cache. */
#include "renderer/frame/scene_cache.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static size_t find_index(const struct scene_cache *cache, const char *key)
{
    size_t i = 0;
    while (i < cache->count && strcmp(cache->entries[i]->key, key) != 0)
        i++;
    return i;
}

struct resident_scene *scene_cache_find(struct scene_cache *cache, const char *key)
{
    size_t i = find_index(cache, key);
    if (i == cache->count)
        return NULL;
    cache->entries[i]->last_use = ++cache->clock;
    return cache->entries[i];
}

static bool reserve(struct scene_cache *cache)
{
    if (cache->count < cache->capacity)
        return true;
    size_t capacity = cache->capacity ? 2 * cache->capacity : 8;
    void *grown = realloc(cache->entries, capacity * sizeof *cache->entries);
    if (!grown)
        return false;
    cache->entries = grown;
    cache->capacity = capacity;
    return true;
}

bool scene_cache_add_composed(struct scene_cache *cache, const struct scene_cache_composed *desc,
                              struct error *err)
{
    struct resident_scene *entry = calloc(1, sizeof *entry);
    struct resident_scene **sources = calloc(desc->source_count, sizeof(*sources));
    if (!entry || !sources || !reserve(cache)) {
        free(entry);
        free(sources);
        return error_set(err, ERROR_NO_MEMORY, "scene cache");
    }
    snprintf(entry->key, sizeof entry->key, "%s", desc->key);
    entry->scene = *composed_scene_get(desc->composed);
    entry->composed = desc->composed;
    entry->gpu = desc->gpu;
    memcpy(sources, desc->sources, desc->source_count * sizeof(*sources));
    entry->sources = sources;
    entry->source_count = desc->source_count;
    entry->last_use = ++cache->clock;
    cache->entries[cache->count++] = entry;
    return true;
}

bool scene_cache_add(struct scene_cache *cache, const struct renderer_scene_desc *desc,
                     struct error *err)
{
    if (strlen(desc->key) >= SCENE_KEY_BYTES)
        return error_set(err, ERROR_INTERNAL, "scene key of %zu bytes", strlen(desc->key));
    struct resident_scene *entry = calloc(1, sizeof *entry);
    if (!entry || !reserve(cache)) {
        free(entry);
        return error_set(err, ERROR_NO_MEMORY, "scene cache");
    }
    snprintf(entry->key, sizeof entry->key, "%s", desc->key);
    entry->scene = *desc->scene;
    entry->gpu = scene_gpu_create(&entry->scene, cache->textures, err);
    if (!entry->gpu) {
        free(entry);
        return false;
    }
    entry->release = desc->release;
    entry->context = desc->context;
    entry->last_use = ++cache->clock;
    cache->entries[cache->count++] = entry;
    return true;
}

void scene_cache_remove(struct scene_cache *cache, const char *key)
{
    size_t i = find_index(cache, key);
    if (i == cache->count)
        return;
    struct resident_scene *entry = cache->entries[i];
    cache->entries[i] = cache->entries[--cache->count];
    scene_gpu_destroy(entry->gpu);
    composed_scene_destroy(entry->composed);
    free(entry->sources);
    if (entry->release)
        entry->release(entry->context);
    free(entry);
}

/* Whether a paused frame shows the scene, or one composed of it. */
static bool is_pinned(const struct scene_cache *cache, const struct resident_scene *entry)
{
    for (size_t i = 0; i < cache->count; i++)
        for (size_t k = 0; cache->entries[i]->is_pinned && k < cache->entries[i]->source_count; k++)
            if (cache->entries[i]->sources[k] == entry)
                return true;
    return entry->is_pinned;
}

static bool is_among(const char *key, const char *const *keys, size_t count)
{
    size_t i = 0;
    while (i < count && strcmp(keys[i], key) != 0)
        i++;
    return i < count;
}

const char *scene_cache_oldest(const struct scene_cache *cache, const char *const *keep,
                               size_t keep_count)
{
    const struct resident_scene *oldest = NULL;
    for (size_t i = 0; i < cache->count; i++) {
        const struct resident_scene *entry = cache->entries[i];
        if (!entry->composed && !is_pinned(cache, entry) &&
            !is_among(entry->key, keep, keep_count) &&
            (!oldest || entry->last_use < oldest->last_use))
            oldest = entry;
    }
    return oldest ? oldest->key : NULL;
}

uint64_t scene_cache_size_bytes(const struct scene_cache *cache)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < cache->count; i++)
        bytes += cache->entries[i]->composed ? 0 : scene_gpu_size_bytes(cache->entries[i]->gpu);
    return bytes;
}

size_t scene_cache_count_composed(const struct scene_cache *cache)
{
    size_t count = 0;
    for (size_t i = 0; i < cache->count; i++)
        count += cache->entries[i]->composed != NULL;
    return count;
}

const char *scene_cache_oldest_composed(const struct scene_cache *cache)
{
    const struct resident_scene *oldest = NULL;
    for (size_t i = 0; i < cache->count; i++)
        if (cache->entries[i]->composed &&
            (!oldest || cache->entries[i]->last_use < oldest->last_use))
            oldest = cache->entries[i];
    return oldest ? oldest->key : NULL;
}

const char *scene_cache_user(const struct scene_cache *cache, const char *key)
{
    for (size_t i = 0; i < cache->count; i++)
        for (size_t k = 0; k < cache->entries[i]->source_count; k++)
            if (strcmp(cache->entries[i]->sources[k]->key, key) == 0)
                return cache->entries[i]->key;
    return NULL;
}

void scene_cache_finish(struct scene_cache *cache)
{
    while (cache->count)
        scene_cache_remove(cache, cache->entries[cache->count - 1]->key);
    free(cache->entries);
    texture_pool_destroy(cache->textures);
    *cache = (struct scene_cache){0};
}

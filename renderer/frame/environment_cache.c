/* SPDX-License-Identifier: MIT */
/* The maps that views may name. */
#include "renderer/frame/environment_cache.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "renderer/frame/frame_budget.h"
#include "renderer/frame/renderer_internal.h"

static struct resident_environment *find(struct environment_cache *cache, const char *key)
{
    for (int i = 0; i < RENDERER_ENVIRONMENTS_MAX; i++)
        if (cache->entries[i].environment && !strcmp(cache->entries[i].key, key))
            return &cache->entries[i];
    return NULL;
}

static void release(struct resident_environment *entry)
{
    environment_maps_finish(&entry->maps);
    if (entry->environment && entry->release)
        entry->release(entry->context);
    *entry = (struct resident_environment){.environment = NULL};
}

void environment_cache_finish(struct environment_cache *cache)
{
    for (int i = 0; i < RENDERER_ENVIRONMENTS_MAX; i++)
        release(&cache->entries[i]);
    environment_destroy(cache->studio);
    cache->studio = NULL;
}

/* Whether a frame that runs, or has yielded, shows it. */
static bool is_shown(const struct renderer *renderer, const struct resident_environment *entry)
{
    return entry->environment && (entry->environment == renderer->frames.use.environment ||
                                  entry->environment == renderer->urgent.use.environment);
}

/* In the place of the least recently used. */
static struct resident_environment *place(struct renderer *renderer,
                                          const struct renderer_environment_desc *desc)
{
    struct environment_cache *cache = &renderer->environments;
    struct resident_environment *entry = NULL; /* free ones were never used */
    for (int i = 0; i < RENDERER_ENVIRONMENTS_MAX; i++)
        if (!is_shown(renderer, &cache->entries[i]) &&
            (!entry || cache->entries[i].last_use < entry->last_use))
            entry = &cache->entries[i];
    assert(entry);
    release(entry);
    *entry = (struct resident_environment){.environment = desc->environment,
                                           .release = desc->release,
                                           .context = desc->context,
                                           .last_use = ++cache->clock};
    snprintf(entry->key, sizeof entry->key, "%s", desc->key);
    return entry;
}

/* NULL with err. */
static struct resident_environment *find_or_make(struct renderer *renderer, const char *key,
                                                 struct error *err)
{
    struct environment_cache *cache = &renderer->environments;
    struct resident_environment *entry = find(cache, key);
    if (entry)
        return entry;
    if (strcmp(key, VIEW_STUDIO_KEY) != 0) {
        error_set(err, ERROR_NOT_FOUND, "environment '%s'", key);
        return NULL;
    }
    if (!cache->studio)
        cache->studio = environment_create_studio(err);
    const struct renderer_environment_desc desc = {.key = key, .environment = cache->studio};
    return cache->studio ? place(renderer, &desc) : NULL;
}

bool environment_cache_open(struct renderer *renderer, const struct view *view,
                            struct environment_light *light, struct error *err)
{
    *light = (struct environment_light){.environment = NULL};
    if (!view_has_environment(view))
        return true;
    struct resident_environment *entry = find_or_make(renderer, view->environment_key, err);
    if (!entry)
        return false;
    entry->last_use = ++renderer->environments.clock;
    *light = environment_light_make(entry->environment, view->environment_rotation_deg,
                                    view->environment_intensity);
    light->is_background = view->environment_is_background;
    return true;
}

const struct environment_maps *environment_cache_maps(struct renderer *renderer,
                                                      const struct environment_light *light,
                                                      struct error *err)
{
    struct resident_environment *entry = renderer->environments.entries;
    while (entry->environment != light->environment)
        entry++; /* it was found when the view was opened */
    frame_budget_reserve(renderer, environment_maps_missing_bytes(&entry->maps, light));
    return environment_maps_prepare(&entry->maps, light, err) ? &entry->maps : NULL;
}

uint64_t environment_cache_size_bytes(const struct environment_cache *cache)
{
    uint64_t bytes = 0;
    for (int i = 0; i < RENDERER_ENVIRONMENTS_MAX; i++)
        bytes += environment_maps_size_bytes(&cache->entries[i].maps);
    return bytes;
}

bool environment_cache_drop_oldest(struct renderer *renderer)
{
    struct resident_environment *oldest = NULL;
    for (int i = 0; i < RENDERER_ENVIRONMENTS_MAX; i++) {
        struct resident_environment *entry = &renderer->environments.entries[i];
        if (environment_maps_size_bytes(&entry->maps) > 0 && !is_shown(renderer, entry) &&
            (!oldest || entry->last_use < oldest->last_use))
            oldest = entry;
    }
    if (oldest)
        environment_maps_finish(&oldest->maps);
    return oldest;
}

bool renderer_attach_environment(struct renderer *renderer,
                                 const struct renderer_environment_desc *desc, struct error *err)
{
    struct environment_cache *cache = &renderer->environments;
    struct resident_environment *entry = find(cache, desc->key);
    size_t length = strlen(desc->key);
    if (!length || length >= ENVIRONMENT_KEY_BYTES)
        return error_set(err, ERROR_INVALID_REQUEST, "environment key of %zu bytes, choose 1 to %d",
                         length, ENVIRONMENT_KEY_BYTES - 1);
    if (entry) {
        entry->last_use = ++cache->clock;
        if (desc->release)
            desc->release(desc->context);
        return true;
    }
    place(renderer, desc);
    return true;
}

bool renderer_has_environment(const struct renderer *renderer, const char *key)
{
    for (int i = 0; i < RENDERER_ENVIRONMENTS_MAX; i++) {
        const struct resident_environment *entry = &renderer->environments.entries[i];
        if (entry->environment && !strcmp(entry->key, key))
            return true;
    }
    return false;
}

void renderer_detach_environment(struct renderer *renderer, const char *key)
{
    struct resident_environment *entry = find(&renderer->environments, key);
    if (entry)
        release(entry);
}

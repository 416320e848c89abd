/* SPDX-License-Identifier: MIT */
/* A list of mapped scenes, most recently used first. */
#include "server/worker/mapped_scenes.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "server/base/ipc.h"

struct mapped_scene {
    struct mapped_scene *next;
    char key[65];
    struct ipc_mapping blob;
    struct scene scene;
    bool is_attached; /* the renderer still needs the mapping */
    bool is_wanted;   /* by the call under way */
};

struct mapped_scenes {
    struct renderer *renderer;
    uint64_t budget_bytes;
    struct mapped_scene *first;
    struct mapped_scenes_totals totals;
};

static void released(void *context)
{
    struct mapped_scene *mapped = context;
    mapped->is_attached = false;
}

static void mapped_scene_destroy(struct mapped_scenes *scenes, struct mapped_scene *mapped)
{
    if (mapped->is_attached)
        renderer_detach_scene(scenes->renderer, mapped->key);
    scenes->totals.bytes -= mapped->blob.size_bytes;
    scenes->totals.scenes--;
    ipc_mapping_finish(&mapped->blob);
    free(mapped);
}

static struct mapped_scene *take(struct mapped_scenes *scenes, const char *key)
{
    for (struct mapped_scene **at = &scenes->first; *at; at = &(*at)->next)
        if (strcmp((*at)->key, key) == 0) {
            struct mapped_scene *mapped = *at;
            *at = mapped->next;
            return mapped;
        }
    return NULL;
}

static struct mapped_scene *map_scene(struct mapped_scenes *scenes, const char *key, int blob_fd,
                                      struct error *err)
{
    struct mapped_scene *mapped = calloc(1, sizeof *mapped);
    if (!mapped) {
        error_set(err, ERROR_NO_MEMORY, "scene");
        return NULL;
    }
    memcpy(mapped->key, key, strlen(key) + 1);
    if (!ipc_mapping_init(&mapped->blob, blob_fd, err) ||
        !scene_open(&mapped->scene, mapped->blob.bytes, mapped->blob.size_bytes, err)) {
        error_wrap(err, "scene '%.64s'", key);
        ipc_mapping_finish(&mapped->blob);
        free(mapped);
        return NULL;
    }
    scenes->totals.bytes += mapped->blob.size_bytes;
    scenes->totals.scenes++;
    return mapped;
}

/* Lets the least recently used go; those that are wanted stay whatever their size. */
static void keep_budget(struct mapped_scenes *scenes)
{
    while (scenes->totals.bytes > scenes->budget_bytes) {
        struct mapped_scene **last = NULL;
        for (struct mapped_scene **at = &scenes->first; *at; at = &(*at)->next)
            if (!(*at)->is_wanted)
                last = at;
        if (!last)
            return;
        struct mapped_scene *mapped = *last;
        *last = mapped->next;
        mapped_scene_destroy(scenes, mapped);
        scenes->totals.evictions++;
    }
}

struct mapped_scenes *mapped_scenes_create(struct renderer *renderer, uint64_t budget_bytes,
                                           struct error *err)
{
    struct mapped_scenes *scenes = calloc(1, sizeof *scenes);
    if (!scenes) {
        error_set(err, ERROR_NO_MEMORY, "scene cache");
        return NULL;
    }
    scenes->renderer = renderer;
    scenes->budget_bytes = budget_bytes;
    return scenes;
}

void mapped_scenes_destroy(struct mapped_scenes *scenes)
{
    if (!scenes)
        return;
    for (struct mapped_scene *mapped; (mapped = scenes->first);) {
        scenes->first = mapped->next;
        mapped_scene_destroy(scenes, mapped);
    }
    free(scenes);
}

/* Moves the scene to the front of the list, and marks it as wanted. */
static struct mapped_scene *ready(struct mapped_scenes *scenes, const char *key, int blob_fd,
                                  struct error *err)
{
    struct mapped_scene *mapped = strlen(key) < sizeof mapped->key ? take(scenes, key) : NULL;
    if (mapped) {
        scenes->totals.hits++;
    } else {
        scenes->totals.misses++;
        if (strlen(key) >= sizeof mapped->key) {
            error_set(err, ERROR_INTERNAL, "scene key of %zu bytes", strlen(key));
            return NULL;
        }
        if (!(mapped = map_scene(scenes, key, blob_fd, err)))
            return NULL;
    }
    mapped->is_wanted = true;
    mapped->next = scenes->first;
    scenes->first = mapped;
    return mapped;
}

static bool attach(struct mapped_scenes *scenes, const struct mapped_scenes_desc *desc,
                   struct mapped_scene *mapped, struct error *err)
{
    struct renderer_scene_desc scene = {
        .key = mapped->key, .scene = &mapped->scene, .keep = desc->keys, .keep_count = desc->count};
    if (mapped->is_attached && renderer_has_scene(scenes->renderer, mapped->key))
        return renderer_attach_scene(scenes->renderer, &scene, err);
    scene.release = released;
    scene.context = mapped;
    mapped->is_attached = renderer_attach_scene(scenes->renderer, &scene, err);
    return mapped->is_attached;
}

bool mapped_scenes_attach(struct mapped_scenes *scenes, const struct mapped_scenes_desc *desc,
                          struct error *err)
{
    struct mapped_scene *wanted[1 + LIMIT_PART_SCENES];
    uint64_t misses = scenes->totals.misses;
    assert(desc->count <= sizeof wanted / sizeof *wanted);
    for (struct mapped_scene *mapped = scenes->first; mapped; mapped = mapped->next)
        mapped->is_wanted = false;
    for (size_t i = 0; i < desc->count; i++)
        if (!(wanted[i] = ready(scenes, desc->keys[i], desc->blob_fds[i], err)))
            return false;
    if (scenes->totals.misses != misses) /* those at hand drive out nothing */
        keep_budget(scenes);
    for (size_t i = 0; i < desc->count; i++)
        if (!attach(scenes, desc, wanted[i], err))
            return false;
    return true;
}

bool mapped_scenes_has(const struct mapped_scenes *scenes, const char *key)
{
    for (const struct mapped_scene *mapped = scenes->first; mapped; mapped = mapped->next)
        if (strcmp(mapped->key, key) == 0)
            return mapped->is_attached && renderer_has_scene(scenes->renderer, key);
    return false;
}

void mapped_scenes_forget(struct mapped_scenes *scenes, const char *key)
{
    struct mapped_scene *mapped = take(scenes, key);
    if (mapped)
        mapped_scene_destroy(scenes, mapped);
}

struct mapped_scenes_totals mapped_scenes_get_totals(const struct mapped_scenes *scenes)
{
    return scenes->totals;
}

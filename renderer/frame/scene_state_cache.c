/* SPDX-License-Identifier: MIT */
/* Caches the evaluated scene between frames, so that a frame whose camera alone has moved composes
 * no transform. */
#include "renderer/frame/renderer_internal.h"
#include "renderer/plan/view_key.h"

const struct scene_state *scene_state_cache_get(struct scene_state_cache *cache,
                                                struct content_key key, const struct scene *scene,
                                                const struct view *view, bool *is_kept,
                                                struct error *err)
{
    struct content_key cut = view_cut_key(view);
    *is_kept = content_key_is_set(cache->key) && content_key_equals(cache->key, key);
    bool is_cut = *is_kept && content_key_equals(cache->cut, cut);
    if (is_cut)
        return &cache->state;
    if (!*is_kept)
        scene_state_cache_drop(cache);
    if (!(*is_kept ? scene_state_cut(&cache->state, view, err)
                   : scene_state_init(&cache->state, scene, view, err))) {
        scene_state_cache_drop(cache);
        return NULL;
    }
    cache->key = key;
    cache->cut = cut;
    return &cache->state;
}

void scene_state_cache_drop(struct scene_state_cache *cache)
{
    scene_state_finish(&cache->state);
    *cache = (struct scene_state_cache){0};
}

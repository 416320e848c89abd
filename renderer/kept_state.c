/* SPDX-License-Identifier: MIT */
/* The evaluated scene between frames: a camera that moves composes no transform. */
#include "renderer/renderer_internal.h"

const struct scene_state *kept_state_get(struct kept_state *kept, struct content_key key,
                                         const struct scene *scene, const struct view *view,
                                         bool *is_kept, struct error *err)
{
    *is_kept = content_key_is_set(kept->key) && content_key_equals(kept->key, key);
    if (*is_kept)
        return &kept->state;
    kept_state_drop(kept);
    if (!scene_state_init(&kept->state, scene, view, err))
        return NULL;
    kept->key = key;
    return &kept->state;
}

void kept_state_drop(struct kept_state *kept)
{
    scene_state_finish(&kept->state);
    *kept = (struct kept_state){0};
}

/* SPDX-License-Identifier: MIT */
/* The evaluated scene between frames: a camera that moves composes no transform. */
#include "renderer/frame/renderer_internal.h"
#include "renderer/plan/view_key.h"

const struct scene_state *kept_state_get(struct kept_state *kept, struct content_key key,
                                         const struct scene *scene, const struct view *view,
                                         bool *is_kept, struct error *err)
{
    struct content_key cut = view_cut_key(view);
    *is_kept = content_key_is_set(kept->key) && content_key_equals(kept->key, key);
    bool is_cut = *is_kept && content_key_equals(kept->cut, cut);
    if (is_cut)
        return &kept->state;
    if (!*is_kept)
        kept_state_drop(kept);
    if (!(*is_kept ? scene_state_cut(&kept->state, view, err)
                   : scene_state_init(&kept->state, scene, view, err))) {
        kept_state_drop(kept);
        return NULL;
    }
    kept->key = key;
    kept->cut = cut;
    return &kept->state;
}

void kept_state_drop(struct kept_state *kept)
{
    scene_state_finish(&kept->state);
    *kept = (struct kept_state){0};
}

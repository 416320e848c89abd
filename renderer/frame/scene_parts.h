/* SPDX-License-Identifier: MIT */
/* The scene that a view shows: one of the cache, or one composed of several of them. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_SCENE_PARTS_H
#define VITRAIL_RENDERER_FRAME_SCENE_PARTS_H

#include "renderer/frame/renderer_internal.h"

/* Kept in the cache for the next call, a few at a time; valid until the next call that attaches or
 * detaches a scene. ERROR_NOT_FOUND names a scene that is not on the GPU, or a part's parent. */
struct resident_scene *renderer_find_scene(struct renderer *renderer, const char *scene_key,
                                           const struct view *view, struct error *err);

/* Makes room by evicting scenes, but not this one or its parts. */
void renderer_evict_others(struct renderer *renderer, const struct resident_scene *scene);

/* Removes the scene, and what is composed of it, with all that is kept of them. */
void renderer_remove_scene(struct renderer *renderer, const char *key);

#endif

/* SPDX-License-Identifier: MIT */
/* What decides a frame, as keys: from the scene's key and the view alone, before either is
 * evaluated. Thread: any. */
#ifndef VITRAIL_RENDERER_PLAN_VIEW_KEY_H
#define VITRAIL_RENDERER_PLAN_VIEW_KEY_H

#include "renderer/base/content_key.h"
#include "renderer/view.h"

/* Of all that decides where the scene's drawables are: the scene and its nodes. */
struct content_key view_placement_key(const char *scene_key, const struct view *view);
/* Of all that decides scene_state_init: the scene, nodes, materials, lights, environment. */
struct content_key view_state_key(const char *scene_key, const struct view *view);
/* Of all that decides scene_state_cut: the clip planes. */
struct content_key view_cut_key(const struct view *view);
/* Of all that decides the picture before anything is drawn over it. */
struct content_key view_picture_key(struct content_key state_key, const struct view *view);
/* Of all that decides the plan: the state, the camera, the size, outputs, planes and quality. */
struct content_key view_plan_key(struct content_key state_key, const struct view *view);

#endif

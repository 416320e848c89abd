/* SPDX-License-Identifier: MIT */
/* Keys of what decides a frame, computed from the scene's key and the view before either is
 * evaluated. Thread: any. */
#ifndef VITRAIL_RENDERER_PLAN_VIEW_KEY_H
#define VITRAIL_RENDERER_PLAN_VIEW_KEY_H

#include "renderer/base/content_key.h"
#include "renderer/view.h"

/* The key of all that decides where the scene's drawables are: the scene and its nodes. */
struct content_key view_placement_key(const char *scene_key, const struct view *view);
/* The key of all that scene_state_init uses: the scene, nodes, materials, lights, environment. */
struct content_key view_state_key(const char *scene_key, const struct view *view);
/* The key of all that scene_state_cut uses: the clip planes. */
struct content_key view_cut_key(const struct view *view);
/* The key of all that decides the picture without its overlays and without the choice. */
struct content_key view_picture_key(struct content_key state_key, const struct view *view);
/* The key of all that decides the plan but for the choice: state, camera, size, outputs, planes and
 * quality. */
struct content_key view_plan_key(struct content_key state_key, const struct view *view);

#endif

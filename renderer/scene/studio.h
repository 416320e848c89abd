/* SPDX-License-Identifier: MIT */
/* Studio lighting: what shines where neither a scene nor its view has a light, and where a view
 * asks for it (docs/explanation/shading.md, section 4).  Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_STUDIO_H
#define VITRAIL_RENDERER_SCENE_STUDIO_H

#include "renderer/scene/scene.h"
#include "renderer/view.h"

/* ON, OFF or BY_DEFAULT. */
enum view_studio studio_of(const struct scene *scene, const struct view *view);

/* Puts that into the view, and the studio's map where the studio shines and the view has no map of
 * its own. */
void studio_apply(const struct scene *scene, struct view *view);

/* Stands still in the world, so that a camera that moves moves no shadow. */
struct view_light studio_key_light(void);

#endif

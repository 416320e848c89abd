/* SPDX-License-Identifier: MIT */
/* What scene_open checks of skins and morph targets. Private to scene.c. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_DEFORMATION_CHECK_H
#define VITRAIL_RENDERER_SCENE_DEFORMATION_CHECK_H

#include "renderer/scene/scene.h"

/* After the hierarchy and the primitives, in time linear in the size of the sections. Whether a
 * skin has the joints that a primitive names, and a mesh the targets that a node has weights for,
 * is left to who evaluates them (renderer/scene/deform.h): nodes may share meshes. */
MUST_CHECK bool scene_check_deformations(const struct scene *scene, struct error *err);

#endif

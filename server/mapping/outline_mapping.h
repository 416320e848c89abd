/* SPDX-License-Identifier: MIT */
/* From a decoded scene to its outline (protocol/scene_outline.h). Thread: any. */
#ifndef VITRAIL_SERVER_MAPPING_OUTLINE_MAPPING_H
#define VITRAIL_SERVER_MAPPING_OUTLINE_MAPPING_H

#include "protocol/scene_outline.h"
#include "renderer/scene/scene.h"

/* The outline must be zeroed; on failure (no memory) its caller finishes it. */
MUST_CHECK bool scene_outline_from_scene(const struct scene *scene, struct scene_outline *outline,
                                         struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* Checks what a scene blob says of density grids. Private to renderer/scene. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_GRID_CHECK_H
#define VITRAIL_RENDERER_SCENE_GRID_CHECK_H

#include "renderer/scene/scene.h"

/* string_bytes: of SCENE_STRINGS. */
MUST_CHECK bool scene_check_grids(const struct scene *scene, uint64_t string_bytes,
                                  struct error *err);

#endif

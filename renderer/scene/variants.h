/* SPDX-License-Identifier: MIT */
/* Variants of materials (KHR_materials_variants): which material each primitive has under one.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_VARIANTS_H
#define VITRAIL_RENDERER_SCENE_VARIANTS_H

#include "renderer/scene/scene.h"

/* Per primitive the index of its material. Of a composed scene, each part that has a variant of
 * that name shows it; "#12" is one of the base alone. NULL where name is NULL; the caller frees.
 * Errors: ERROR_NOT_FOUND, with the names that there are. */
MUST_CHECK bool variant_materials_create(const struct scene *scene, const char *name,
                                         uint32_t **materials, struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* The lobes of a material in the words of requests. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_MATERIAL_LOBES_H
#define VITRAIL_RENDERER_SCENE_MATERIAL_LOBES_H

#include "protocol/lobe_members.h"
#include "renderer/scene/scene_blob.h"

/* Gives the material what is said; the rest stays. */
void material_lobes_set(struct scene_material *material, const struct lobe_members *lobes);

/* What the material has: members of lobes that it has nothing of are not said. */
struct lobe_members material_lobes_get(const struct scene_material *material);

#endif

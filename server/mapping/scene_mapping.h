/* SPDX-License-Identifier: MIT */
/* From a decoded scene to its summary. Thread: any; nothing here touches GL. */
#ifndef VITRAIL_SERVER_MAPPING_SCENE_MAPPING_H
#define VITRAIL_SERVER_MAPPING_SCENE_MAPPING_H

#include "protocol/error.h"
#include "protocol/scene_summary.h"
#include "renderer/scene/scene.h"

/* Everything the blob knows: the id, name, upload size and time of creation are the caller's to
 * fill in. The summary must be zeroed; on failure it is zeroed again. */
MUST_CHECK bool scene_summary_from_scene(const struct scene *scene, struct scene_summary *summary,
                                         struct error *err);

#endif

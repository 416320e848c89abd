/* SPDX-License-Identifier: MIT */
/* Density grids as elements of linked shadow lists, one for all of a grid in each list that it
 * meets, as published (Lindbeck 2015; docs/explanation/media.md). */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_LINKED_GRIDS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_LINKED_GRIDS_H

#include "renderer/gl/program.h"
#include "renderer/shadows/shadow_map.h"

/* Inserts them into the lists of a light, whose other casters are in their lists: heads, nodes and
 * statistics are bound, the first of them with these offsets. Thread: GL. */
MUST_CHECK bool shadow_linked_add_grids(struct program_cache *programs,
                                        const struct shadow_build *build,
                                        const struct shadow_scene *scene, uint64_t first_head,
                                        uint64_t first_node, struct error *err);

/* Thread: any. */
void shadow_linked_list_grids(const struct scene_state *state, struct program_list *list);

#endif

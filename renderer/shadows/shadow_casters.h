/* SPDX-License-Identifier: MIT */
/* Finds the casters of one light, by face. CPU only. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_CASTERS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_CASTERS_H

#include "renderer/shadows/shadow_map.h"

/* Lists the items of state that cast a shadow in the frame. casters must be zeroed or finished by
 * the caller. */
MUST_CHECK bool shadow_casters_collect(struct shadow_casters *casters,
                                       const struct shadow_frame *frame,
                                       const struct scene_state *state, struct error *err);
void shadow_casters_finish(struct shadow_casters *casters);
/* copy must be zeroed or finished by the caller. */
MUST_CHECK bool shadow_casters_copy(const struct shadow_casters *casters,
                                    struct shadow_casters *copy, struct error *err);
/* Gives the map the clip planes that run through casters which it shows. */
void shadow_casters_cut(const struct shadow_casters *casters, const struct scene_state *state,
                        struct shadow_map *map);
/* Adds, over the faces, the casters that each sees and the others of the scene. */
void shadow_casters_count(const struct shadow_casters *casters, uint32_t face_count,
                          const struct scene_state *state, uint64_t *drawn, uint64_t *culled);

#endif

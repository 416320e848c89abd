/* SPDX-License-Identifier: MIT */
/* 128-bit keys of all that decides a shadow structure: equal keys, equal structure. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_KEY_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_KEY_H

#include "renderer/shadows/shadow_map.h"

struct shadow_key shadow_key_of_text(const char *text);
/* From the map's scene, frame, kind, flags and resolution, the blend filter, and the casters that
 * it shows. */
struct shadow_key shadow_key_of_map(const struct shadow_map *map,
                                    const struct shadow_casters *casters,
                                    const struct scene_state *state, uint32_t blend_filter);

static inline bool shadow_key_equals(struct shadow_key a, struct shadow_key b)
{
    return a.words[0] == b.words[0] && a.words[1] == b.words[1];
}

#endif

/* SPDX-License-Identifier: MIT */
/* 128-bit keys of all that decides a shadow structure: equal keys, equal structure. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_KEY_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_KEY_H

#include "renderer/shadows/shadow_map.h"

static inline struct content_key shadow_key_of_scene(const char *scene_key)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, scene_key);
    return key;
}

/* The cache key of a map: of its scene, frame, kind, flags and resolution, the blend filter, and
 * the casters that it shows. */
struct content_key shadow_key_of_map(const struct shadow_map *map,
                                     const struct shadow_casters *casters,
                                     const struct scene_state *state, uint32_t blend_filter);

static inline struct content_key shadow_key_join(struct content_key a, struct content_key b)
{
    const uint64_t odd = 0x9e3779b97f4a7c15ull; /* of splitmix64: bits spread, order shows */
    return (struct content_key){{(a.words[0] ^ b.words[0]) * odd, (a.words[1] + b.words[1]) * odd}};
}

#endif

/* SPDX-License-Identifier: MIT */
/* Parts of a deep shadow map that is larger than a storage block of the device: rows of one face
 * each, whose counts, and whose lists, a block holds. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_PARTS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_PARTS_H

#include "renderer/shadows/shadow_map.h"

struct shadow_part {             /* zeroed: before the first */
    struct shadow_window window; /* of the light's faces */
    uint64_t first_texel, texels;
    struct shadow_range events; /* of its lists, in the pool */
};

/* Whether the map is built in parts: its counts, or, with has_lists, its events exceed a block. */
bool shadow_parts_are_needed(const struct shadow_store *store, const struct shadow_map *map,
                             bool has_lists);

/* Goes on to the next part; behind the last one it has no texels. With has_lists the heads of the
 * map must stand: some of them are read, which waits. ERROR_OVER_BUDGET where the lists of a single
 * row exceed a block. */
MUST_CHECK bool shadow_part_next(const struct shadow_store *store, const struct shadow_map *map,
                                 bool has_lists, struct shadow_part *part, struct error *err);

/* The part as a map of its own, whose events are still those of the whole. */
struct shadow_map shadow_part_map(const struct shadow_map *map, const struct shadow_part *part);

#endif

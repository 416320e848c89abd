/* SPDX-License-Identifier: MIT */
/* Hashing of what decides a shadow structure. */
#include "renderer/shadows/shadow_key.h"

#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static void add_doubles(struct content_key *key, const double *values, size_t count)
{
    content_key_add(key, values, count * sizeof *values);
}

struct content_key shadow_key_of_map(const struct shadow_map *map,
                                     const struct shadow_casters *casters,
                                     const struct scene_state *state, uint32_t blend_filter)
{
    const struct shadow_frame *frame = &map->frame;
    struct content_key key = content_key_begin();
    content_key_add_word(&key, map->scene.words[0]);
    content_key_add_word(&key, map->scene.words[1]);
    content_key_add_word(&key, (uint64_t)map->method->id | (uint64_t)map->flags << 8 |
                                   (uint64_t)map->is_faithful << 16 |
                                   (uint64_t)map->resolution << 32);
    content_key_add_word(&key, frame->shape | (uint64_t)blend_filter << 32);
    add_doubles(&key, frame->origin, 3);
    add_doubles(&key, frame->axis[0], 9);
    add_doubles(&key, frame->scale, 2);
    add_doubles(
        &key,
        (double[]){frame->unit_m, frame->near_m, frame->depth_m, frame->range_m, frame->cone_rad},
        5);
    add_doubles(&key, frame->cone, 3);
    if (map->flags & SHADOW_FLAG_NODES) {
        add_doubles(&key, &map->compression, 1);
        content_key_add_word(&key, (uint64_t)map->prefilter << 1 | map->has_media);
    }
    for (size_t i = 0; map->holds_grids && i < state->grid_count; i++)
        content_key_add_word(&key, state->grids[i].shadow_hash);
    if (map->holds_grids)
        add_doubles(&key, state->shadow_planes[0], 4 * state->shadow_plane_count);
    content_key_add_word(&key, map->plane_count);
    add_doubles(&key, map->planes[0], 4 * (size_t)map->plane_count);
    for (size_t i = 0; i < casters->count; i++) {
        const struct state_item *item = &state->items[casters->items[i]];
        if (item->class_ == STATE_TRANSPARENT && !map->method->structure->filters)
            continue; /* a plain map does not show it */
        content_key_add_word(&key, item->shadow_hash);
        if (map->method->structure->divide)
            content_key_add_word(&key, item->node);
        content_key_add_word(&key, casters->faces[i] | (uint64_t)item->class_ << 32);
    }
    return key;
}

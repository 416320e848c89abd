/* SPDX-License-Identifier: MIT */
/* Cutting a map into parts: by numbers of texels, and by the heads of its lists. */
#include "renderer/shadows/shadow_parts.h"

static uint64_t rows_of_face(const struct shadow_map *map)
{
    return (uint64_t)(map->window.row_count ? map->window.row_count : map->resolution);
}

bool shadow_parts_are_needed(const struct shadow_store *store, const struct shadow_map *map,
                             bool has_lists)
{
    return map->depths.count > shadow_store_block(store, SHADOW_POOL_DEPTHS) ||
           (has_lists && map->events.count > shadow_store_block(store, SHADOW_POOL_EVENTS));
}

/* Where the list of the texel begins, from the light's first event on. */
static uint64_t head_of(const struct shadow_store *store, const struct shadow_map *map,
                        uint64_t texel)
{
    uint32_t head = 0; /* a lost context reads nothing */
    gl_buffer_read(&store->pools[SHADOW_POOL_HEADS].streams[0], (map->heads.first + texel) * 4,
                   sizeof head, &head);
    return head;
}

/* As many of the rows as have lists that a block holds. */
static bool cut_rows(const struct shadow_store *store, const struct shadow_map *map,
                     struct shadow_part *part, uint64_t *rows, struct error *err)
{
    uint64_t side = (uint64_t)map->resolution, most = shadow_store_block(store, SHADOW_POOL_EVENTS);
    uint64_t begin = head_of(store, map, part->first_texel), count = 0;
    uint64_t fits = 0, exceeds = *rows + 1; /* rows */
    for (uint64_t try = *rows; exceeds - fits > 1; try = (fits + exceeds) / 2) {
        uint64_t found = head_of(store, map, part->first_texel + try * side) - begin;
        if (found <= most) {
            fits = try;
            count = found;
        } else {
            exceeds = try;
        }
    }
    if (!fits) {
        uint64_t found = head_of(store, map, part->first_texel + side) - begin;
        return shadow_store_check_block(store, SHADOW_POOL_EVENTS, found, map->light, err);
    }
    *rows = fits;
    part->events = (struct shadow_range){map->events.first + begin, count};
    return true;
}

bool shadow_part_next(const struct shadow_store *store, const struct shadow_map *map,
                      bool has_lists, struct shadow_part *part, struct error *err)
{
    uint64_t side = (uint64_t)map->resolution, face_rows = rows_of_face(map);
    uint64_t first = part->first_texel + part->texels, row = first / side;
    uint64_t rows = face_rows - row % face_rows;
    uint64_t most = shadow_store_block(store, SHADOW_POOL_DEPTHS) / side;
    *part = (struct shadow_part){.first_texel = first};
    if (first == shadow_map_texels(map))
        return true;
    rows = rows < most ? rows : most;
    if (has_lists && !cut_rows(store, map, part, &rows, err))
        return false;
    part->texels = rows * side;
    part->window = (struct shadow_window){
        .face = map->window.row_count ? map->window.face : (uint32_t)(row / face_rows),
        .first_row = map->window.first_row + (int)(row % face_rows),
        .row_count = (int)rows};
    return true;
}

struct shadow_map shadow_part_map(const struct shadow_map *map, const struct shadow_part *part)
{
    struct shadow_map own = *map;
    own.window = part->window;
    own.depths = (struct shadow_range){map->depths.first + part->first_texel, part->texels};
    own.heads = (struct shadow_range){map->heads.first + part->first_texel, part->texels + 1};
    return own;
}

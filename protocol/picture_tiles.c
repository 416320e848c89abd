/* SPDX-License-Identifier: MIT */
/* Halves, of which the first is never the longer one: as split_window of
 * renderer/frame/frame_run.c. */
#include "protocol/picture_tiles.h"

static int parts_of(int length, int most)
{
    int parts = 1;
    while ((length + parts - 1) / parts > most)
        parts *= 2;
    return parts;
}

struct picture_tiles picture_tiles_make(int width, int height, int tile_width, int tile_height)
{
    return (struct picture_tiles){.width = width,
                                  .height = height,
                                  .columns = parts_of(width, tile_width),
                                  .rows = parts_of(height, tile_height)};
}

static void find_part(int length, int parts, int index, int *first, int *size)
{
    *first = 0;
    *size = length;
    for (int half = parts / 2; half > 0; half /= 2) {
        int before = *size / 2;
        if (index & half) {
            *first += before;
            *size -= before;
        } else {
            *size = before;
        }
    }
}

struct request_tile picture_tiles_get(const struct picture_tiles *tiles, int index)
{
    struct request_tile tile = {.is_given = true};
    find_part(tiles->width, tiles->columns, index % tiles->columns, &tile.x, &tile.width);
    find_part(tiles->height, tiles->rows, index / tiles->columns, &tile.y, &tile.height);
    return tile;
}

/* SPDX-License-Identifier: MIT */
/* A picture cut into a grid of tiles by halving it again and again, as the renderer halves pictures
 * into the windows that it draws, so that no window is drawn for two tiles. Thread: any. */
#ifndef VITRAIL_PROTOCOL_PICTURE_TILES_H
#define VITRAIL_PROTOCOL_PICTURE_TILES_H

#include "protocol/render_request.h"

/* Zeroed = the picture is in one piece. */
struct picture_tiles {
    int width, height; /* of the picture, px */
    int columns, rows; /* powers of two */
};

/* Whether the picture is larger than what is rendered in one piece. */
static inline bool picture_needs_tiles(int64_t width, int64_t height)
{
    return width > LIMIT_IMAGE_SIDE_PX || height > LIMIT_IMAGE_SIDE_PX;
}

/* Tiles of at most this size. */
struct picture_tiles picture_tiles_make(int width, int height, int tile_width, int tile_height);

static inline int picture_tiles_count(const struct picture_tiles *tiles)
{
    return tiles->columns * tiles->rows;
}

/* The tile of that index, row by row from the top. */
struct request_tile picture_tiles_get(const struct picture_tiles *tiles, int index);

#endif

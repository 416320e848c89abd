/* SPDX-License-Identifier: MIT */
/* Colours in blocks of 4 x 4 texels (EXT_texture_compression_s3tc): opaque ones in 8 bytes, an
 * eighth of RGBA8 (BC1, or DXT1); with alpha in 16 (BC3, or DXT5). Thread: any. */
#ifndef VITRAIL_RENDERER_TEXTURES_TEXTURE_BLOCKS_H
#define VITRAIL_RENDERER_TEXTURES_TEXTURE_BLOCKS_H

#include <stdbool.h>
#include <stdint.h>

enum { TEXTURE_BLOCK_SIDE = 4 };

static inline uint32_t texture_block_bytes(bool has_alpha)
{
    return has_alpha ? 16 : 8;
}

static inline uint32_t texture_blocks_across(uint32_t side_px)
{
    return (side_px + TEXTURE_BLOCK_SIDE - 1) / TEXTURE_BLOCK_SIDE;
}

/* Bytes of the levels from `first` to the last one, one after the other. */
uint64_t texture_blocks_bytes(uint32_t width_px, uint32_t height_px, uint32_t first,
                              bool has_alpha);

/* rgba: of one level, rows without gaps; without has_alpha it is taken as 1; blocks across an edge
 * repeat it. Alpha of 0 and 1 stays so. blocks: row by row. Adds to *squares the squared
 * differences of red, green and blue, and of alpha where there is one, in steps of 1/255, of what
 * blocks decode to (by the format's exact fractions, to the nearest step). The same bytes on every
 * machine. */
void texture_blocks_encode(const uint8_t *rgba, uint32_t width_px, uint32_t height_px,
                           bool has_alpha, uint8_t *blocks, double *squares);

#endif

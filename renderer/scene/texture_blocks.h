/* SPDX-License-Identifier: MIT */
/* Opaque images in blocks of 4 x 4 texels and 8 bytes, an eighth of RGBA8: BC1, or DXT1
 * (EXT_texture_compression_s3tc). Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_TEXTURE_BLOCKS_H
#define VITRAIL_RENDERER_SCENE_TEXTURE_BLOCKS_H

#include <stdint.h>

enum { TEXTURE_BLOCK_SIDE = 4, TEXTURE_BLOCK_BYTES = 8 };

static inline uint32_t texture_blocks_across(uint32_t side_px)
{
    return (side_px + TEXTURE_BLOCK_SIDE - 1) / TEXTURE_BLOCK_SIDE;
}

/* Bytes of the levels from `first` to the last one, one after the other. */
uint64_t texture_blocks_bytes(uint32_t width_px, uint32_t height_px, uint32_t first);

/* rgba: of one level, rows without gaps; alpha is taken as 1, blocks across an edge repeat it.
 * blocks: row by row. Adds to *squares the squared differences of red, green and blue, in steps of
 * 1/255, of what blocks decode to (by the format's exact fractions, to the nearest step). The same
 * bytes on every machine. */
void texture_blocks_encode(const uint8_t *rgba, uint32_t width_px, uint32_t height_px,
                           uint8_t *blocks, double *squares);

#endif

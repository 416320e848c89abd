/* SPDX-License-Identifier: MIT */
/* The least and the largest alpha of each block of an image. They decide most lookups of a mask
 * without a texel, and they fit into caches that the texels exceed. Alpha itself is stored by
 * blocks, too: a block is one cache line, where the rows of the image would be eight lines or more.
 * Thread: built by one, then read by any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_MASK_H
#define VITRAIL_RENDERER_RAYTRACE_RT_MASK_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

enum { RT_MASK_BLOCK = 8 }; /* texels a side */

struct rt_mask {
    uint8_t (*bounds)[2]; /* owned; of each block and one texel more to the right and below; NULL:
                             there is no mask */
    /* Owned; of each block, by row; 0 beyond the image. */
    uint8_t (*alpha)[RT_MASK_BLOCK][RT_MASK_BLOCK];
    uint32_t columns;
};

/* texels: RGBA, 8 bits. */
MUST_CHECK bool rt_mask_init(struct rt_mask *mask, const uint8_t *texels, uint32_t width,
                             uint32_t height, struct error *err);
void rt_mask_finish(struct rt_mask *mask); /* accepts zeroed */

static inline size_t rt_mask_block(const struct rt_mask *mask, size_t x, size_t y)
{
    return y / RT_MASK_BLOCK * mask->columns + x / RT_MASK_BLOCK;
}

/* Of one texel of the image. */
static inline uint8_t rt_mask_alpha(const struct rt_mask *mask, size_t x, size_t y)
{
    return mask->alpha[rt_mask_block(mask, x, y)][y % RT_MASK_BLOCK][x % RT_MASK_BLOCK];
}

/* Bounds of the alpha of the texels x to x + 1, y to y + 1, all of them in the image. */
static inline const uint8_t *rt_mask_bounds(const struct rt_mask *mask, size_t x, size_t y)
{
    return mask->bounds[rt_mask_block(mask, x, y)];
}

#endif

/* SPDX-License-Identifier: MIT */
/* Alpha and its bounds by blocks of texels. */
#include "renderer/raytrace/rt_mask.h"

#include <stdlib.h>
#include <string.h>

static uint32_t end_of_block(uint32_t block, uint32_t size)
{
    uint32_t end = (block + 1) * RT_MASK_BLOCK + 1;
    return end < size ? end : size;
}

bool rt_mask_init(struct rt_mask *mask, const uint8_t *texels, uint32_t width, uint32_t height,
                  struct error *err)
{
    uint32_t columns = (width + RT_MASK_BLOCK - 1) / RT_MASK_BLOCK;
    uint32_t rows = (height + RT_MASK_BLOCK - 1) / RT_MASK_BLOCK;
    *mask = (struct rt_mask){.columns = columns};
    mask->bounds = calloc((size_t)columns * rows + 1, sizeof *mask->bounds);
    mask->alpha = aligned_alloc(64, ((size_t)columns * rows + 1) * sizeof *mask->alpha);
    if (!mask->bounds || !mask->alpha)
        return error_set(err, ERROR_NO_MEMORY, "mask of %u x %u texels", width, height);
    for (uint32_t b = 0; b < columns * rows; b++) {
        uint32_t column = b % columns, row = b / columns;
        uint8_t least = 255, most = 0;
        memset(mask->alpha[b], 0, sizeof mask->alpha[b]);
        for (uint32_t y = row * RT_MASK_BLOCK; y < end_of_block(row, height); y++) {
            for (uint32_t x = column * RT_MASK_BLOCK; x < end_of_block(column, width); x++) {
                uint8_t alpha = texels[4 * ((size_t)y * width + x) + 3];
                least = alpha < least ? alpha : least;
                most = alpha > most ? alpha : most;
                if (y / RT_MASK_BLOCK == row && x / RT_MASK_BLOCK == column)
                    mask->alpha[b][y % RT_MASK_BLOCK][x % RT_MASK_BLOCK] = alpha;
            }
        }
        mask->bounds[b][0] = least;
        mask->bounds[b][1] = most;
    }
    return true;
}

void rt_mask_finish(struct rt_mask *mask)
{
    free(mask->bounds);
    free(mask->alpha);
    *mask = (struct rt_mask){0};
}

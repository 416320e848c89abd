/* SPDX-License-Identifier: MIT */
/* Levels of detail of an image: their sizes, and their pixels as means over areas. Level 0 is the
 * image; each further one has half the sides of the one before, rounded down, at least 1 (OpenGL
 * 4.5 core profile, 8.14.3). Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_TEXTURE_LEVELS_H
#define VITRAIL_RENDERER_SCENE_TEXTURE_LEVELS_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"

static inline uint32_t texture_level_side(uint32_t side_px, uint32_t level)
{
    return side_px >> level ? side_px >> level : 1;
}

enum { TEXTURE_LEVELS_MAX = 32 }; /* of sides below 2^32 */

uint32_t texture_level_count(uint32_t width_px, uint32_t height_px);

/* RGBA8 bytes of the levels from `first` to the last one, one after the other; 0 past the last. */
uint64_t texture_levels_bytes(uint32_t width_px, uint32_t height_px, uint32_t first);

struct texture_tables; /* between sRGB and linear (IEC 61966-2-1) */
struct texture_tables *texture_tables_create(struct error *err);
void texture_tables_destroy(struct texture_tables *tables);

struct texture_levels_desc {
    const struct texture_tables *tables; /* required */
    const uint8_t *pixels;               /* required; level 0, RGBA8, rows without gaps */
    uint32_t width_px, height_px;        /* [1, 16384] */
    bool is_srgb;                        /* RGB is averaged as light; alpha as it is */
};
/* Fills `levels`, of texture_levels_bytes(..., 1) bytes, with level 1 and all that follow. Sums are
 * of whole numbers: the same bytes on every machine. */
void texture_levels_build(const struct texture_levels_desc *desc, uint8_t *levels);

#endif

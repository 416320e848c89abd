/* SPDX-License-Identifier: MIT */
/* Numbers in the bytes of image files, the lowest byte first. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_LITTLE_ENDIAN_H
#define VITRAIL_RENDERER_IMAGE_LITTLE_ENDIAN_H

#include <stdint.h>

static inline uint32_t le16(const uint8_t *b)
{
    return (uint32_t)b[1] << 8 | b[0];
}

static inline uint32_t le24(const uint8_t *b)
{
    return (uint32_t)b[2] << 16 | le16(b);
}

static inline uint32_t le32(const uint8_t *b)
{
    return le16(b + 2) << 16 | le16(b);
}

#endif

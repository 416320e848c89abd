/* SPDX-License-Identifier: MIT */
/* FNV-1a of 64 bits (Fowler, Noll and Vo): a digest of few bytes, not against attackers. Thread:
 * any.
 */
#ifndef VITRAIL_RENDERER_BASE_FNV_H
#define VITRAIL_RENDERER_BASE_FNV_H

#include <stddef.h>
#include <stdint.h>

#define FNV_BEGIN 0xcbf29ce484222325ull

/* Goes on from the digest of what comes before. */
static inline uint64_t fnv_add(uint64_t digest, const void *bytes, size_t size_bytes)
{
    const unsigned char *p = (const unsigned char *)bytes;
    for (size_t i = 0; i < size_bytes; i++)
        digest = (digest ^ p[i]) * 0x100000001b3ull;
    return digest;
}

#endif

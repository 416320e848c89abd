/* SPDX-License-Identifier: MIT */
/* Compresses levels of images on threads of its own. Thread: GL; the work is on the packer's. */
#ifndef VITRAIL_RENDERER_TEXTURES_TEXTURE_PACKER_H
#define VITRAIL_RENDERER_TEXTURES_TEXTURE_PACKER_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"

struct texture_packer;

enum { TEXTURE_PACKER_AHEAD = 8 }; /* so many at once, those that nobody took among them */

/* ERROR_INTERNAL when no thread can be started. */
struct texture_packer *texture_packer_create(struct error *err);
void texture_packer_destroy(struct texture_packer *packer); /* waits for those being made */

/* Levels [top, end) of an image; the memory must stay until they are taken or drained. */
struct texture_packing {
    const uint8_t *image;         /* level 0, RGBA8 */
    const uint8_t *levels;        /* 1 and on, one after the other */
    uint32_t width_px, height_px; /* of level 0 */
    uint8_t top, end;
    bool has_alpha;
};

struct texture_packed { /* zeroed: none */
    uint8_t *blocks;    /* of all its levels, one after the other: malloc'ed */
    double mean_square; /* of a channel's error in the finest, of 1 */
};

/* True when it is done and can be taken. Else it is queued, where that takes no other's place. */
bool texture_packer_ask(struct texture_packer *packer, const struct texture_packing *what);
/* Waits for it; without memory there are no blocks. */
struct texture_packed texture_packer_take(struct texture_packer *packer,
                                          const struct texture_packing *what);

/* Forgets what was asked for, and waits for those being made; NULL: nothing to do. */
void texture_packer_drain(struct texture_packer *packer);

#endif

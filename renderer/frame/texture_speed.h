/* SPDX-License-Identifier: MIT */
/* Measures whether a device gains by compressed textures: what samples of them take beside samples
 * of whole ones, and what compressing takes. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_TEXTURE_SPEED_H
#define VITRAIL_RENDERER_FRAME_TEXTURE_SPEED_H

#include "renderer/renderer.h"

struct texture_speed {
    double whole_ns, bc1_ns, bc3_ns; /* of one sample among many, bilinear, of sRGB */
    double encode_bytes_per_ms;      /* of RGBA8 to BC1, on one thread */
};

/* Samples of blocks may take so many times those of whole textures: measuring is no better. */
#define TEXTURE_SPEED_SLOWER_MOST 1.1
/* An image of 2048 x 2048 and its levels, 22 MB, within a second. */
#define TEXTURE_SPEED_ENCODE_LEAST 22e3

/* `auto` compresses where it would withhold so many levels else: what blocks lose is then less
 * (docs/explanation/memory-budget.md, "Large textures"). */
enum { TEXTURE_SPEED_AUTO_LEVELS = 5 };

/* Takes a few ms where programs are compiled already, once for each of three formats: the same work
 * in turns, the least of each. True with *speed zeroed where the device samples no blocks.
 * Leaves nothing behind but a compiled program. */
MUST_CHECK bool texture_speed_measure(struct renderer *renderer, struct texture_speed *speed,
                                      double *elapsed_ms, struct error *err);

bool texture_speed_is_known(const struct texture_speed *speed);
/* Whether the speed is known, and blocks are no slower to sample and quick to encode. */
bool texture_speed_gains(const struct texture_speed *speed);

#endif

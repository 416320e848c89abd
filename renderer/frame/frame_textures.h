/* SPDX-License-Identifier: MIT */
/* Streams in the texture levels that a frame's passes can sample, before they run. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_TEXTURES_H
#define VITRAIL_RENDERER_FRAME_FRAME_TEXTURES_H

#include "renderer/frame/frame_run.h"

struct frame_textures { /* zeroed = none */
    struct texture_passes passes;
    size_t key_count;
    uint8_t *wanted; /* by any pass */
    /* Some texture lacks levels that were wanted, or exact ones: nothing drawn may be kept. */
    bool is_inexact;
};

/* Fills the report's `textures`, with a warning where levels are withheld or to come. Nothing
 * happens to scenes whose textures are resident as a whole. */
MUST_CHECK bool frame_textures_begin(struct frame_textures *textures, const struct frame_run *run,
                                     struct error *err);
/* Brings back what another frame took away meanwhile. */
MUST_CHECK bool frame_textures_resume(struct frame_textures *textures, const struct frame_run *run,
                                      struct error *err);
void frame_textures_end(struct frame_textures *textures, const struct frame_run *run);

/* Chooses texture levels within the rasteriser's budget for a ray traced picture, which reads them
 * from the scene's file. *levels: malloc'ed, per texture_key the finest that may be sampled;
 * NULL: any. Fills the report's `textures` where the GPU samples none. */
MUST_CHECK bool frame_textures_plan_traced(const struct frame_run *run, uint8_t **levels,
                                           struct error *err);

#endif

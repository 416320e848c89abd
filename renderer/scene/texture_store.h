/* SPDX-License-Identifier: MIT */
/* The images of a scene on the GPU, within a budget. What fits is there as a whole from the start;
 * else a frame names the levels that it can need (renderer/scene/texture_need.h), and those are
 * there while it is drawn. Thread: GL. */
#ifndef VITRAIL_RENDERER_SCENE_TEXTURE_STORE_H
#define VITRAIL_RENDERER_SCENE_TEXTURE_STORE_H

#include "renderer/frame_report.h"
#include "renderer/gl/object.h"
#include "renderer/scene/scene.h"

struct texture_store;

/* budget_bytes: of all levels resident at once; above it only while one texture takes the place of
 * its coarser or finer self. ERROR_UNSUPPORTED for an image larger than the device takes. */
struct texture_store *texture_store_create(const struct scene *scene, uint64_t budget_bytes,
                                           struct error *err);
void texture_store_destroy(struct texture_store *store);

/* False: everything is resident, and no frame needs to ask. */
bool texture_store_is_on_demand(const struct texture_store *store);
uint64_t texture_store_resident_bytes(const struct texture_store *store);

struct texture_wish {
    const uint8_t *levels; /* required: per texture_key the finest level of all passes of the frame,
                              or TEXTURE_UNNEEDED */
    bool may_be_coarse; /* draw with what is there after limit_bytes were written; else with all */
    uint64_t limit_bytes; /* of one frame that may be coarse; 0 means 16 MiB */
};

/* Makes room and brings levels, those of this frame before all others'. Where the wish exceeds the
 * budget, every texture is withheld the same number of levels, and gets one back while there is
 * room, in the order of the images: the same wish is granted the same levels. ERROR_OVER_BUDGET
 * when not even the coarsest levels fit. */
MUST_CHECK bool texture_store_prepare(struct texture_store *store, const struct texture_wish *wish,
                                      struct report_textures *report, struct error *err);

/* Of a scene that is there as a whole. */
void texture_store_report(const struct texture_store *store, struct report_textures *report);

/* The texture of a key as if `finest` were its finest level: so that what a pass samples depends on
 * that pass and not on what else is resident. NULL where no material samples the image so. */
const struct gl_texture *texture_store_use(struct texture_store *store, uint32_t key,
                                           uint8_t finest);

#endif

/* SPDX-License-Identifier: MIT */
/* The images of scenes on the GPU, all within one budget. Scenes whose images fit it together are
 * drawn with all levels; else a frame names the levels that it can need
 * (renderer/textures/texture_need.h), and those are there while it is drawn. Thread: GL. */
#ifndef VITRAIL_RENDERER_TEXTURES_TEXTURE_STORE_H
#define VITRAIL_RENDERER_TEXTURES_TEXTURE_STORE_H

#include "renderer/frame_report.h"
#include "renderer/gl/object.h"
#include "renderer/gl/scope.h"
#include "renderer/scene/scene.h"

struct texture_pool;  /* the budget, and what stands within it */
struct texture_store; /* the images of one scene */

struct texture_pool_desc {
    uint64_t budget_bytes;    /* required: of all levels resident at once; above it only while one
                                 texture takes the place of its coarser or finer self */
    uint64_t upload_bytes;    /* written for one frame that may be coarse; 0 means 16 MiB */
    double upload_ms;         /* spent on that, at most, but for one call; 0 means 4 */
    uint32_t compresses_from; /* texture_pool_set_compression */
    bool waits;               /* frames wait for what they wrote, so that the pace of uploads
                                 follows the device's: where the device is our processors */
};

/* Measures how fast the device takes levels, 2 ms or so. */
struct texture_pool *texture_pool_create(const struct texture_pool_desc *desc, struct error *err);
void texture_pool_destroy(struct texture_pool *pool);              /* after all of its stores */
double texture_pool_bytes_per_ms(const struct texture_pool *pool); /* as measured, lately */
/* Colours are compressed where a wish exceeds the budget so that so many levels or more would be
 * withheld else; of more than 1, where besides one level less would take twice the budget. 0:
 * never. Takes effect with the next wish. */
void texture_pool_set_compression(struct texture_pool *pool, uint32_t from_levels);
bool texture_pool_samples_blocks(const struct texture_pool *pool); /* the device does */
bool texture_pool_compresses(const struct texture_pool *pool);     /* asked to, and able to */

/* Of a scene that fits the budget alone all levels are brought, in the place of what others did
 * not use for longest. The scene stays borrowed. ERROR_UNSUPPORTED for an image larger than the
 * device takes. */
struct texture_store *texture_store_create(struct texture_pool *pool, const struct scene *scene,
                                           struct error *err);
void texture_store_destroy(struct texture_store *store);
uint64_t texture_store_resident_bytes(const struct texture_store *store);

/* Whether all levels of these fit the budget together: by their sizes alone, whatever is there. */
bool texture_pool_has_room_for(const struct texture_pool *pool, struct texture_store *const *stores,
                               size_t count);

struct texture_demand {
    struct texture_store *store; /* required; each once in a wish */
    const uint8_t *levels;       /* per texture_key the finest level of all passes of the frame, or
                                    TEXTURE_UNNEEDED; NULL: all levels of what materials sample */
};
struct texture_wish {
    const struct texture_demand *demands; /* required: of all scenes of the frame */
    size_t count;
    struct gpu_timeline *timeline; /* optional: told before the device is waited for */
    bool may_be_coarse; /* draw with what is there after the limits of uploads; else with all */
};

/* Makes room and brings levels, those of this frame before all others'. Where the wish exceeds the
 * budget, every texture is withheld the same number of levels, and gets one back while there is
 * room, in the order of the demands and images: the same wish is granted the same levels. Where
 * these are as many as the pool compresses from, colours are compressed
 * (renderer/textures/texture_blocks.h), on other threads, and withheld one level less than the
 * rest, for half of their bytes, or as many with alpha. A frame that may be coarse reads no file,
 * but for the first 16 px of textures that have nothing on the GPU, where there was no room to keep
 * them. ERROR_OVER_BUDGET when not even the coarsest levels fit. */
MUST_CHECK bool texture_pool_prepare(struct texture_pool *pool, const struct texture_wish *wish,
                                     struct report_textures *report, struct error *err);

/* What texture_pool_prepare would grant, for a frame that reads the scene's file instead: nothing
 * comes or goes. report: resident_bytes are of what is granted, blocks where these are. */
MUST_CHECK bool texture_pool_plan(struct texture_pool *pool, const struct texture_wish *wish,
                                  struct report_textures *report, struct error *err);
/* Of the last wish that named the store: the finest level, or TEXTURE_UNNEEDED. */
uint8_t texture_store_granted(const struct texture_store *store, uint32_t key);

/* The texture of a key as if `finest` were its finest level: so that what a pass samples depends on
 * that pass and not on what else is resident. NULL where no material samples the image so. */
const struct gl_texture *texture_store_use(struct texture_store *store, uint32_t key,
                                           uint8_t finest);

#endif

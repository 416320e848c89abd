/* SPDX-License-Identifier: MIT */
/* The images of all scenes on the GPU, within one budget. If the images of a view's scenes fit the
 * budget together, the view is drawn with all levels of detail (mips). If not, each frame requests
 * the levels that it can sample (renderer/textures/texture_need.h), and the pool makes them
 * resident before the frame is drawn. docs/explanation/memory-budget.md explains the rules.
 * In this folder the wanted levels are those that a frame can sample, and the budgeted levels those
 * that it is drawn with: the budget may withhold finer ones. Thread: GL. */
#ifndef VITRAIL_RENDERER_TEXTURES_TEXTURE_STORE_H
#define VITRAIL_RENDERER_TEXTURES_TEXTURE_STORE_H

#include "renderer/frame_report.h"
#include "renderer/gl/object.h"
#include "renderer/gl/scope.h"
#include "renderer/scene/scene.h"

struct texture_pool;  /* the budget, and the textures that are resident within it */
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

/* Also measures how fast the device takes uploads, which takes about 2 ms. */
struct texture_pool *texture_pool_create(const struct texture_pool_desc *desc, struct error *err);
void texture_pool_destroy(struct texture_pool *pool);              /* after all of its stores */
double texture_pool_bytes_per_ms(const struct texture_pool *pool); /* as measured, lately */
/* Colours are compressed when the budget would withhold from_levels levels or more without
 * compression. For from_levels above 1 there is a second condition: textures with one level more
 * would need twice the budget. 0 never compresses. Takes effect with the next request. */
void texture_pool_set_compression(struct texture_pool *pool, uint32_t from_levels);
bool texture_pool_samples_blocks(const struct texture_pool *pool); /* the device can */
bool texture_pool_compresses(const struct texture_pool *pool);     /* it may and it can */

/* If the scene alone fits the budget, all of its levels count as resident from now on, and textures
 * of other scenes are evicted for them, the least recently used ones first. They are uploaded for
 * the first frame that samples them: pictures that rays make alone need none. The scene stays
 * borrowed. Fails with ERROR_UNSUPPORTED if an image is larger than the device takes. */
struct texture_store *texture_store_create(struct texture_pool *pool, const struct scene *scene,
                                           struct error *err);
void texture_store_destroy(struct texture_store *store);
uint64_t texture_store_resident_bytes(const struct texture_store *store);

/* Whether all levels of these stores fit the budget together. It goes by their sizes alone, and not
 * by what is resident. */
bool texture_pool_has_room_for(const struct texture_pool *pool, struct texture_store *const *stores,
                               size_t count);

struct texture_demand {
    struct texture_store *store; /* required; each once in a request */
    const uint8_t *levels;       /* per texture_key the finest level of all passes of the frame, or
                                    TEXTURE_UNNEEDED; NULL: all levels of what materials sample */
};
struct texture_request {
    const struct texture_demand *demands; /* required: of all scenes of the frame */
    size_t count;
    struct gpu_timeline *timeline; /* optional: notified before a wait for the device */
    bool may_be_coarse; /* draw with what is there after the limits of uploads; else with all */
};

/* Evicts textures that the frame does not need, and uploads the levels that it does; for the first
 * frame of a scene that fits the budget alone all of them.
 *
 * If the request exceeds the budget, the same number of levels is withheld from every texture. Then
 * textures get one level back, in the order of demands and images, while there is room. So equal
 * requests get equal levels. If the number is large enough for compression (see above), colours are
 * compressed on other threads (renderer/textures/texture_blocks.h). One level less is withheld from
 * these, for half of their bytes, or for as many bytes where they have alpha.
 *
 * A frame that may be coarse does not read the scene's file, except for the first levels of 16 px
 * of textures that have no level on the GPU. Fails with ERROR_OVER_BUDGET if not even the coarsest
 * levels fit. */
MUST_CHECK bool texture_pool_prepare(struct texture_pool *pool,
                                     const struct texture_request *request,
                                     struct report_textures *report, struct error *err);

/* Finds the levels that texture_pool_prepare would make resident, for a frame that reads them from
 * the scene's file (ray tracing). Nothing is uploaded or evicted. report: resident_bytes counts
 * these levels, in compressed form if they would be compressed. */
MUST_CHECK bool texture_pool_plan(struct texture_pool *pool, const struct texture_request *request,
                                  struct report_textures *report, struct error *err);
/* The finest level within the budget of the last request with this store, or TEXTURE_UNNEEDED. */
uint8_t texture_store_budgeted(const struct texture_store *store, uint32_t key);

/* The texture of a key, with `finest` as the finest level that it samples. So the picture of a pass
 * depends on the levels that this pass needs, and not on finer ones that are resident for another
 * pass. NULL if no material samples the image in this form. */
const struct gl_texture *texture_store_use(struct texture_store *store, uint32_t key,
                                           uint8_t finest);

#endif

/* SPDX-License-Identifier: MIT */
/* The pool and its stores: creation, requests of frames, and the textures they draw with. */
#include "renderer/textures/texture_store.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>

#include "renderer/base/wall_clock.h"
#include "renderer/textures/texture_store_internal.h"

static const uint64_t default_upload_bytes = 16 << 20;
static const double DEFAULT_UPLOAD_MS = 4;

/* ---- the pool ---- */

struct texture_pool *texture_pool_create(const struct texture_pool_desc *desc, struct error *err)
{
    struct texture_pool *pool = calloc(1, sizeof *pool);
    if (!pool) {
        error_set(err, ERROR_NO_MEMORY, "pool of textures");
        return NULL;
    }
    pool->budget_bytes = desc->budget_bytes;
    pool->upload_bytes = desc->upload_bytes ? desc->upload_bytes : default_upload_bytes;
    pool->upload_ms = desc->upload_ms > 0 ? desc->upload_ms : DEFAULT_UPLOAD_MS;
    pool->waits = desc->waits;
    pool->packs_from = desc->compresses_from;
    pool->can_pack = texture_device_packs();
    if (texture_measure_pace(&pool->pace, pool->upload_ms, err))
        return pool;
    texture_pool_destroy(pool);
    return NULL;
}

void texture_pool_destroy(struct texture_pool *pool)
{
    if (!pool)
        return;
    assert(!pool->stores);
    texture_reader_destroy(pool->reader);
    texture_packer_destroy(pool->packer);
    free(pool->textures);
    free(pool->missing);
    free(pool);
}

void texture_pool_set_compression(struct texture_pool *pool, uint32_t from_levels)
{
    pool->packs_from = from_levels;
}

bool texture_pool_samples_blocks(const struct texture_pool *pool)
{
    return pool->can_pack;
}

bool texture_pool_compresses(const struct texture_pool *pool)
{
    return pool->can_pack && pool->packs_from > 0;
}

double texture_pool_bytes_per_ms(const struct texture_pool *pool)
{
    return pool->pace.bytes_per_ms;
}

bool texture_pool_has_room_for(const struct texture_pool *pool, struct texture_store *const *stores,
                               size_t count)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < count; i++)
        bytes += stores[i]->whole_bytes;
    return bytes <= texture_budget_bytes(pool);
}

/* ---- what a frame asks for ---- */

static bool is_demanded(const struct texture_request *request, const struct texture_store *store)
{
    size_t i = 0;
    while (i < request->count && request->demands[i].store != store)
        i++;
    return i < request->count;
}

static bool reserve(struct texture_pool *pool, struct error *err)
{
    size_t count = 0;
    for (const struct texture_store *store = pool->stores; store; store = store->next)
        count += store->count;
    if (count <= pool->capacity)
        return true;
    free(pool->textures);
    free(pool->missing);
    pool->textures = calloc(count, sizeof(*pool->textures));
    pool->missing = calloc(count, sizeof(*pool->missing));
    pool->capacity = pool->textures && pool->missing ? count : 0;
    return pool->capacity || error_set(err, ERROR_NO_MEMORY, "%zu textures", count);
}

static void list(struct texture_pool *pool, const struct texture_demand *demand, bool is_drawn)
{
    for (uint32_t key = 0; key < demand->store->count; key++) {
        struct stored_texture *t = &demand->store->textures[key];
        t->wanted = !t->is_used ? TEXTURE_UNNEEDED : demand->levels ? demand->levels[key] : 0;
        if (is_drawn && t->wanted != TEXTURE_UNNEEDED)
            t->last_use = pool->clock;
        pool->textures[pool->count++] = t;
    }
}

/* Lists the textures that the request names, then all others, which no pass of the frame needs. */
static bool list_all(struct texture_pool *pool, const struct texture_request *request,
                     struct error *err)
{
    pool->count = pool->request_count = 0;
    if (!reserve(pool, err))
        return false;
    pool->clock++;
    for (size_t i = 0; i < request->count; i++)
        list(pool, &request->demands[i], true);
    pool->request_count = pool->count;
    for (struct texture_store *store = pool->stores; store; store = store->next)
        for (uint32_t key = 0; !is_demanded(request, store) && key < store->count; key++) {
            store->textures[key].wanted = store->textures[key].budgeted = TEXTURE_UNNEEDED;
            pool->textures[pool->count++] = &store->textures[key];
        }
    return true;
}

static bool is_whole(const struct texture_store *store)
{
    const struct texture_incoming *in = &store->pool->incoming;
    return store->full_bytes == store->whole_bytes && (!in->of || in->of->store != store);
}

/* The case of most frames: all levels are requested, and all are resident. */
static bool has_all(struct texture_pool *pool, const struct texture_request *request,
                    struct report_textures *report)
{
    for (size_t i = 0; i < request->count; i++)
        if (request->demands[i].levels || !is_whole(request->demands[i].store))
            return false;
    pool->clock++;
    for (size_t i = 0; i < request->count; i++) {
        request->demands[i].store->last_use = pool->clock;
        report->wanted_bytes += request->demands[i].store->whole_bytes;
    }
    return true;
}

/* A texture that changes its form may become smaller, but all of it has to be uploaded. */
static uint64_t lacking_bytes(const struct stored_texture *t)
{
    uint64_t bytes = texture_budgeted_from(t, t->budgeted);
    return texture_is_otherwise(t) || bytes < t->full.texture.size_bytes
               ? bytes
               : bytes - t->full.texture.size_bytes;
}

static void count_missing(const struct texture_pool *pool, struct report_textures *report)
{
    double squares = 0, texels = 0;
    for (size_t i = 0; i < pool->request_count; i++) {
        struct stored_texture *t = pool->textures[i];
        const struct texture_levels_held *present = texture_present(t);
        if (t->wanted == TEXTURE_UNNEEDED)
            continue;
        report->coarse_count += !present || present->top > t->wanted;
        if (texture_is_missing(t))
            report->pending_bytes += lacking_bytes(t);
        if (!t->full.texture.name || !t->full.is_packed)
            continue;
        double area = (double)t->full.texture.width * t->full.texture.height;
        squares += t->full.mean_square * area;
        texels += area;
        report->compressed_count++;
        report->compressed_bytes += t->full.texture.size_bytes;
    }
    report->compressed_rmse = texels > 0 ? sqrt(squares / texels) : 0;
}

static struct texture_spending limits_of(const struct texture_pool *pool, bool may_be_coarse)
{
    struct texture_spending spending = {
        .begin_ms = wall_ms(), .limit_bytes = UINT64_MAX, .limit_ms = INFINITY};
    if (!may_be_coarse)
        return spending;
    double bytes = pool->pace.bytes_per_ms * pool->upload_ms;
    spending.limit_ms = pool->upload_ms;
    spending.limit_bytes =
        bytes < (double)pool->upload_bytes ? (uint64_t)bytes : pool->upload_bytes;
    return spending;
}

static bool stream_in(struct texture_pool *pool, const struct texture_request *request,
                      struct report_textures *report, struct error *err)
{
    if (request->timeline) /* work of before is not of what is measured */
        gpu_timeline_will_wait(request->timeline);
    struct texture_spending spending = limits_of(pool, request->may_be_coarse);
    bool is_good = request->may_be_coarse ? texture_stream_some(pool, &spending, err)
                                          : texture_stream_all(pool, &spending, err);
    if (spending.written_bytes && pool->waits)
        glFinish(); /* what the device is still busy with counts, too */
    double taken_ms = wall_ms() - spending.begin_ms;
    if (request->may_be_coarse && pool->waits &&
        texture_pace_is_measured(&pool->pace, spending.written_bytes, spending.limit_bytes))
        texture_note_pace(&pool->pace, pool->upload_ms, spending.written_bytes, taken_ms);
    report->written_bytes += spending.written_bytes;
    report->upload_ms += taken_ms;
    return is_good;
}

/* The first frame that samples textures of a scene uploads what was reserved for them, whether it
 * may be coarse or not. */
static bool bring_reserved(struct texture_pool *pool, const struct texture_request *request,
                           struct report_textures *report, struct error *err)
{
    struct texture_spending spending = {
        .begin_ms = wall_ms(), .limit_bytes = UINT64_MAX, .limit_ms = INFINITY};
    bool is_good = true;
    for (size_t i = 0; i < request->count; i++) {
        struct texture_store *store = request->demands[i].store;
        for (uint32_t key = 0; is_good && key < store->count; key++)
            if (texture_is_reserved(&store->textures[key]))
                is_good = texture_bring_reserved(&store->textures[key], &spending, err);
    }
    if (!spending.written_bytes)
        return is_good;
    if (request->timeline)
        gpu_timeline_will_wait(request->timeline);
    if (pool->waits)
        glFinish();
    report->written_bytes = spending.written_bytes;
    report->upload_ms = wall_ms() - spending.begin_ms;
    return is_good;
}

static bool has_packer(struct texture_pool *pool, struct error *err)
{
    return !pool->packs || pool->packer || (pool->packer = texture_packer_create(err)) != NULL;
}

bool texture_pool_prepare(struct texture_pool *pool, const struct texture_request *request,
                          struct report_textures *report, struct error *err)
{
    bool is_good = true;
    *report = (struct report_textures){.budget_bytes = pool->budget_bytes};
    pool->most_bytes = pool->resident_bytes;
    if (!bring_reserved(pool, request, report, err))
        return false;
    if (!has_all(pool, request, report)) {
        if (!pool->reader && !(pool->reader = texture_reader_create(err)))
            return false;
        is_good = list_all(pool, request, err) &&
                  texture_budget_levels(pool, request->may_be_coarse, report, err) &&
                  has_packer(pool, err) && stream_in(pool, request, report, err);
        count_missing(pool, report);
    }
    report->resident_bytes = pool->resident_bytes;
    return is_good;
}

bool texture_pool_plan(struct texture_pool *pool, const struct texture_request *request,
                       struct report_textures *report, struct error *err)
{
    *report = (struct report_textures){.budget_bytes = pool->budget_bytes};
    pool->count = pool->request_count = 0;
    if (!reserve(pool, err))
        return false;
    for (size_t i = 0; i < request->count; i++)
        list(pool, &request->demands[i], false);
    pool->request_count = pool->count;
    if (!texture_budget_levels(pool, request->may_be_coarse, report, err))
        return false;
    for (size_t i = 0; i < pool->request_count; i++) {
        const struct stored_texture *t = pool->textures[i];
        if (t->wanted == TEXTURE_UNNEEDED)
            continue;
        report->resident_bytes += texture_budgeted_from(t, t->budgeted);
        report->coarse_count += t->budgeted > t->wanted;
    }
    return true;
}

uint8_t texture_store_budgeted(const struct texture_store *store, uint32_t key)
{
    return store->textures[key].budgeted;
}

const struct gl_texture *texture_store_use(struct texture_store *store, uint32_t key,
                                           uint8_t finest)
{
    struct stored_texture *t = &store->textures[key];
    struct texture_levels_held *held = texture_present(t);
    assert(!texture_is_reserved(t)); /* frames that sample prepare first */
    if (!held)
        return NULL;
    uint8_t base = finest != TEXTURE_UNNEEDED && finest > held->top ? finest : held->top;
    if (base != held->base && t->needs_levels) {
        glTextureParameteri(held->texture.name, GL_TEXTURE_BASE_LEVEL, base - held->top);
        held->base = base;
    }
    return &held->texture;
}

uint64_t texture_store_resident_bytes(const struct texture_store *store)
{
    return store->full_bytes + store->floor_bytes;
}

/* ---- stores ---- */

static void note_uses(struct texture_store *store)
{
    const struct scene *s = store->scene;
    for (uint32_t m = 0; m < s->material_count; m++)
        for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
            int32_t texture = s->materials[m].textures[slot].texture;
            int32_t image = texture >= 0 ? s->textures[texture].image : -1;
            if (image < 0)
                continue;
            struct stored_texture *t =
                &store->textures[texture_key((uint32_t)image, scene_slot_is_srgb(slot))];
            uint32_t filter = s->textures[texture].min_filter;
            t->is_used = true;
            t->needs_levels |= filter != GL_NEAREST && filter != GL_LINEAR;
        }
}

static bool check_sizes(struct texture_store *store, struct error *err)
{
    GLint most;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    for (uint32_t key = 0; key < store->count; key++) {
        struct stored_texture *t = &store->textures[key];
        t->store = store;
        t->key = key;
        t->width = store->scene->images[key / 2].width_px;
        t->height = store->scene->images[key / 2].height_px;
        t->level_count = (uint8_t)texture_level_count(t->width, t->height);
        t->budgeted = t->wanted = TEXTURE_UNNEEDED;
        if (!t->is_used)
            continue;
        if (t->width > (uint32_t)most || t->height > (uint32_t)most)
            return error_set(err, ERROR_UNSUPPORTED, "image %u is %ux%u, the device takes %d",
                             key / 2, t->width, t->height, most);
        t->can_pack = store->pool->can_pack && (key & 1);
        t->has_alpha = store->scene->images[key / 2].least_alpha < 255;
        store->whole_bytes += texture_bytes_from(t, 0, false);
    }
    return true;
}

/* Takes the room of all levels if they fit, and else uploads the coarsest ones. */
static bool fill(struct texture_store *store, struct error *err)
{
    struct texture_pool *pool = store->pool;
    bool is_good = true, is_whole = texture_pool_has_room_for(pool, &store, 1);
    if (is_whole)
        is_good = list_all(pool, &(struct texture_request){.count = 0}, err) &&
                  texture_drop_unneeded(pool, pool->floor_bytes + store->whole_bytes, err);
    for (uint32_t key = 0; is_good && key < store->count; key++) {
        struct stored_texture *t = &store->textures[key];
        if (t->is_used && is_whole)
            texture_reserve(t);
        else if (t->is_used)
            is_good = texture_make_floor(t, true, err);
    }
    return is_good;
}

struct texture_store *texture_store_create(struct texture_pool *pool, const struct scene *scene,
                                           struct error *err)
{
    struct texture_store *store = calloc(1, sizeof *store);
    if (store)
        store->textures = calloc(2 * (size_t)scene->image_count + 1, sizeof *store->textures);
    if (!store || !store->textures) {
        free(store);
        error_set(err, ERROR_NO_MEMORY, "%u images", scene->image_count);
        return NULL;
    }
    store->pool = pool;
    store->scene = scene;
    store->count = 2 * scene->image_count;
    note_uses(store);
    bool is_good = check_sizes(store, err) && fill(store, err);
    store->last_use = pool->clock;
    store->next = pool->stores;
    pool->stores = store;
    if (is_good)
        return store;
    texture_store_destroy(store);
    return NULL;
}

void texture_store_destroy(struct texture_store *store)
{
    if (!store)
        return;
    struct texture_pool *pool = store->pool;
    struct texture_store **at = &pool->stores;
    if (pool->incoming.of && pool->incoming.of->store == store)
        texture_abandon(&pool->incoming);
    texture_reader_drain(pool->reader);
    texture_packer_drain(pool->packer);
    for (uint32_t key = 0; key < store->count; key++)
        if (store->textures[key].store)
            texture_drop_all(&store->textures[key]);
    while (*at != store)
        at = &(*at)->next;
    *at = store->next;
    free(store->textures);
    free(store);
}

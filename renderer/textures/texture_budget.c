/* SPDX-License-Identifier: MIT */
/* Decides which levels of a frame fit the budget, and which textures are evicted for them. */
#include "renderer/textures/texture_store_internal.h"

uint64_t texture_budget_bytes(const struct texture_pool *pool)
{
    return pool->budget_bytes - pool->budget_bytes / TEXTURE_FLOOR_SHARE;
}

/* A compressed texture with one level more takes half of the bytes of the uncompressed one; if it
 * has alpha, as many. */
static uint32_t biased(const struct stored_texture *t, uint32_t bias)
{
    uint32_t level = t->wanted + (t->packs && bias ? bias - 1 : bias), last = texture_last_level(t);
    return level < last ? level : last;
}

/* Takes colours in compressed form, or all textures uncompressed. */
static void set_packing(struct texture_pool *pool, bool packs)
{
    for (size_t i = 0; i < pool->request_count; i++)
        pool->textures[i]->packs = packs && pool->textures[i]->can_pack;
}

static uint64_t budgeted_bytes(const struct texture_pool *pool, uint32_t bias)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < pool->request_count; i++)
        if (pool->textures[i]->wanted != TEXTURE_UNNEEDED)
            bytes += texture_budgeted_from(pool->textures[i], biased(pool->textures[i], bias));
    return bytes;
}

/* Gives levels back one by one, in the order of the request, while there is room. */
static void give_back(struct texture_pool *pool, uint32_t bias, uint64_t bytes)
{
    for (; bias > 0; bias--)
        for (size_t i = 0; i < pool->request_count; i++) {
            struct stored_texture *t = pool->textures[i];
            if (t->wanted == TEXTURE_UNNEEDED || t->budgeted < t->wanted + bias)
                continue;
            uint64_t more =
                texture_budgeted_from(t, t->budgeted - 1u) - texture_budgeted_from(t, t->budgeted);
            if (bytes + more > texture_budget_bytes(pool))
                continue;
            bytes += more;
            t->budgeted--;
        }
}

/* Whether the budget would withhold too many levels without compression: any level, or from_levels
 * of most textures while all of them with one level more would take twice the budget. Frames in
 * motion keep textures that are compressed already until they request much less. */
static bool must_pack(const struct texture_pool *pool, bool may_be_coarse)
{
    uint32_t from = pool->packs_from, bias = from;
    uint64_t budget = texture_budget_bytes(pool);
    if (!texture_pool_compresses(pool))
        return false;
    for (size_t i = 0; may_be_coarse && i < pool->request_count; i++)
        if (pool->textures[i]->full.is_packed)
            return budgeted_bytes(pool, from - 1) > budget / 4 * 3;
    while (bias < TEXTURE_LEVELS_MAX && budgeted_bytes(pool, bias) > budget)
        bias++;
    return budgeted_bytes(pool, bias - 1) > (from > 1 ? 2 * budget : budget);
}

bool texture_budget_levels(struct texture_pool *pool, bool may_be_coarse,
                           struct report_textures *report, struct error *err)
{
    uint32_t bias = 0;
    uint64_t budget = texture_budget_bytes(pool);
    set_packing(pool, false);
    report->wanted_bytes = budgeted_bytes(pool, 0);
    pool->packs = must_pack(pool, may_be_coarse);
    set_packing(pool, pool->packs);
    uint64_t bytes = budgeted_bytes(pool, 0);
    while (bytes > budget) {
        uint64_t before = bytes;
        bytes = budgeted_bytes(pool, ++bias);
        if (bytes == before && bias > TEXTURE_LEVELS_MAX)
            return error_set(err, ERROR_OVER_BUDGET,
                             "the coarsest levels of the textures in view take %llu bytes, the "
                             "budget of textures is %llu",
                             (unsigned long long)bytes, (unsigned long long)pool->budget_bytes);
    }
    for (size_t i = 0; i < pool->count; i++) {
        struct stored_texture *t = pool->textures[i];
        t->budgeted = (uint8_t)(t->wanted == TEXTURE_UNNEEDED ? TEXTURE_UNNEEDED : biased(t, bias));
    }
    give_back(pool, bias, bytes);
    for (size_t i = 0; i < pool->request_count; i++) {
        const struct stored_texture *t = pool->textures[i];
        uint32_t withheld = t->wanted == TEXTURE_UNNEEDED ? 0u : (uint32_t)t->budgeted - t->wanted;
        report->level_bias = withheld > report->level_bias ? withheld : report->level_bias;
    }
    return true;
}

bool texture_is_missing(struct stored_texture *t)
{
    const struct texture_levels_held *present = texture_present(t);
    return t->budgeted != TEXTURE_UNNEEDED &&
           (!present || present->top > t->budgeted || texture_is_otherwise(t));
}

bool texture_is_otherwise(const struct stored_texture *t)
{
    return t->full.texture.name && t->full.is_packed != t->packs;
}

uint64_t texture_bytes_to_be(const struct texture_pool *pool)
{
    uint64_t bytes = pool->floor_bytes;
    for (size_t i = 0; i < pool->request_count; i++) {
        struct stored_texture *t = pool->textures[i];
        if (t->budgeted != TEXTURE_UNNEEDED)
            bytes += texture_is_missing(t) ? texture_budgeted_from(t, t->budgeted)
                                           : t->full.texture.size_bytes;
    }
    return bytes;
}

uint64_t texture_unneeded_bytes(const struct texture_pool *pool)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < pool->count; i++)
        if (pool->textures[i]->budgeted == TEXTURE_UNNEEDED)
            bytes += pool->textures[i]->full.texture.size_bytes;
    return bytes;
}

static uint64_t last_use(const struct stored_texture *t)
{
    return t->last_use > t->store->last_use ? t->last_use : t->store->last_use;
}

struct stored_texture *texture_find_victim(const struct texture_pool *pool)
{
    struct stored_texture *found = NULL;
    for (size_t i = 0; i < pool->count; i++) {
        struct stored_texture *t = pool->textures[i];
        if (t->budgeted == TEXTURE_UNNEEDED && t->full.texture.size_bytes > 0 &&
            (!found || last_use(t) < last_use(found)))
            found = t;
    }
    return found;
}

bool texture_drop_unneeded(struct texture_pool *pool, uint64_t bytes, struct error *err)
{
    struct stored_texture *victim;
    bytes += texture_unneeded_bytes(pool);
    while (bytes > pool->budget_bytes && (victim = texture_find_victim(pool)) != NULL) {
        uint64_t floors = pool->floor_bytes;
        bytes -= victim->full.texture.size_bytes;
        if (!texture_let_go(victim, err))
            return false;
        bytes += pool->floor_bytes - floors;
    }
    return true;
}

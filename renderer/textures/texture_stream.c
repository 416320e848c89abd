/* SPDX-License-Identifier: MIT */
/* Streams levels in: all budgeted ones for a frame at rest, and as many as the limits allow for a
 * frame in motion, the coarsest textures first. */
#include "renderer/textures/texture_store_internal.h"

enum {
    STEP_LEVELS = 2,                       /* a sixteenth of the bytes first, of all textures */
    READ_AHEAD = TEXTURE_PACKER_AHEAD - 1, /* textures that are read before it is their turn */
};

static uint64_t level_bytes(const struct stored_texture *t, uint32_t level)
{
    return 4ull * texture_level_side(t->width, level) * texture_level_side(t->height, level);
}

/* Whether the texture holds finer levels than the budget allows, which may be evicted. */
static bool is_too_fine(const struct stored_texture *t)
{
    return t->budgeted != TEXTURE_UNNEEDED && t->full.texture.name && t->full.top < t->budgeted &&
           !texture_is_otherwise(t);
}

static void advance_incoming(struct texture_pool *pool, struct texture_spending *spending)
{
    if (!pool->incoming.of)
        return;
    texture_advance(&pool->incoming, spending);
    if (texture_is_complete(&pool->incoming))
        texture_install(&pool->incoming);
}

/* ---- all ---- */

static uint64_t size_budgeted(const struct stored_texture *t)
{
    return texture_budgeted_from(t, t->budgeted);
}

static bool shrinks(const struct stored_texture *t)
{
    return size_budgeted(t) < t->full.texture.size_bytes;
}

/* Requests the levels of the next missing textures from the reader or the packer. shrinking: only
 * of textures that become smaller. */
static void read_ahead(struct texture_pool *pool, size_t from, bool shrinking)
{
    struct texture_packing what;
    for (int ahead = 0; from < pool->request_count && ahead < READ_AHEAD; from++) {
        struct stored_texture *t = pool->textures[from];
        if (!texture_is_missing(t) || (shrinking && !shrinks(t)))
            continue;
        if (!t->packs)
            texture_reader_ask(pool->reader, texture_level_pixels(t, t->budgeted),
                               level_bytes(t, t->budgeted));
        else if (texture_needs_packing(t, t->budgeted, &what))
            texture_packer_ask(pool->packer, &what);
        ahead++;
    }
}

/* Decides about an upload that an earlier frame in motion began. It is completed if this frame
 * waits for it, stays if it is in nobody's way, and is abandoned otherwise. */
static void settle_incoming(struct texture_pool *pool, uint64_t bytes,
                            struct texture_spending *spending)
{
    struct texture_incoming *in = &pool->incoming;
    struct stored_texture *t = in->of;
    if (!t)
        return;
    if (texture_is_missing(t) && in->top == t->budgeted && in->is_packed == t->packs) {
        advance_incoming(pool, spending);
        return;
    }
    bool is_surpassed =
        (t->full.texture.name && t->full.is_packed == in->is_packed && t->full.top <= in->top) ||
        (t->budgeted != TEXTURE_UNNEEDED && in->is_packed != t->packs);
    bytes += texture_unneeded_bytes(pool) + in->texture.size_bytes;
    if (texture_is_missing(t) || is_surpassed || bytes > pool->budget_bytes)
        texture_abandon(in);
}

/* Uploads textures that are missing. shrinking: only those that become smaller by it. */
static bool stream_missing(struct texture_pool *pool, bool shrinking,
                           struct texture_spending *spending, struct error *err)
{
    for (size_t i = 0; i < pool->request_count; i++) {
        struct stored_texture *t = pool->textures[i];
        if (!texture_is_missing(t) || (shrinking && !shrinks(t)))
            continue;
        read_ahead(pool, i + 1, shrinking);
        if (!texture_replace(t, t->budgeted, spending, err))
            return false;
    }
    return true;
}

/* Makes room first: evicts textures that the frame does not need, then replaces those that become
 * smaller and those that are too fine. */
bool texture_stream_all(struct texture_pool *pool, struct texture_spending *spending,
                        struct error *err)
{
    uint64_t bytes = texture_bytes_to_be(pool);
    settle_incoming(pool, bytes, spending);
    if (!texture_drop_unneeded(pool, bytes, err) || !stream_missing(pool, true, spending, err))
        return false;
    for (size_t i = 0; i < pool->request_count && bytes > pool->budget_bytes; i++) {
        struct stored_texture *t = pool->textures[i];
        if (!is_too_fine(t))
            continue;
        bytes -= t->full.texture.size_bytes - size_budgeted(t);
        if (!texture_replace(t, t->budgeted, spending, err))
            return false;
    }
    return stream_missing(pool, false, spending, err);
}

/* ---- some ---- */

static uint32_t present_top(struct stored_texture *t)
{
    const struct texture_levels_held *present = texture_present(t);
    return present ? present->top : t->level_count;
}

/* The finest level of the next step of a frame in motion. */
static uint8_t next_top(struct stored_texture *t)
{
    return (uint8_t)(present_top(t) > t->budgeted + STEP_LEVELS + 1u ? t->budgeted + STEP_LEVELS
                                                                     : t->budgeted);
}

/* Whether the new levels are in memory, in compressed form if the texture is compressed. If not,
 * the call requests them. */
static bool are_read(struct texture_pool *pool, struct stored_texture *t, uint32_t top)
{
    bool all = true;
    struct texture_packing what;
    if (t->packs)
        return !texture_needs_packing(t, top, &what) || texture_packer_ask(pool->packer, &what);
    uint32_t end = t->needs_levels ? t->level_count : top + 1u;
    for (uint32_t level = top; level < end; level++)
        all &=
            texture_has_level(t, level, false) ||
            texture_reader_ask(pool->reader, texture_level_pixels(t, level), level_bytes(t, level));
    return all;
}

/* How many levels the texture lacks; 0 if only its form (compressed or not) is the wrong one. */
static uint32_t lacks(struct stored_texture *t)
{
    uint32_t top = present_top(t);
    return top > t->budgeted ? top - t->budgeted : 0;
}

/* Lists the textures that are missing: those that lack most levels first, and equal ones in the
 * order of the request. */
static size_t list_missing(struct texture_pool *pool)
{
    size_t starts[TEXTURE_LEVELS_MAX + 2] = {0}, count = 0;
    for (size_t i = 0; i < pool->request_count; i++) {
        struct stored_texture *t = pool->textures[i];
        if (texture_is_missing(t))
            starts[TEXTURE_LEVELS_MAX - lacks(t) + 1]++, count++;
    }
    for (int i = 1; i < TEXTURE_LEVELS_MAX + 2; i++)
        starts[i] += starts[i - 1];
    for (size_t i = 0; i < pool->request_count; i++) {
        struct stored_texture *t = pool->textures[i];
        if (texture_is_missing(t))
            pool->missing[starts[TEXTURE_LEVELS_MAX - lacks(t)]++] = t;
    }
    return count;
}

/* Evicts other textures for this one, as many as the limits allow. */
static bool make_room(const struct stored_texture *t, uint32_t top,
                      const struct texture_spending *spending, bool *has_room, struct error *err)
{
    struct texture_pool *pool = t->store->pool;
    struct stored_texture *victim = NULL;
    uint64_t more = texture_budgeted_from(t, top) - t->full.texture.size_bytes;
    while (pool->resident_bytes + more > pool->budget_bytes &&
           !texture_spending_is_over(spending) && (victim = texture_find_victim(pool)) != NULL)
        if (!texture_let_go(victim, err))
            return false;
    *has_room = pool->resident_bytes + more <= pool->budget_bytes;
    return true;
}

static bool begin(struct texture_pool *pool, struct stored_texture *t, uint32_t top,
                  struct texture_spending *spending, struct error *err)
{
    struct texture_packing what;
    struct texture_packed packed = {0};
    if (t->packs && texture_needs_packing(t, top, &what))
        packed = texture_packer_take(pool->packer, &what); /* it is done */
    if (!texture_begin(t, top, &packed, &pool->incoming, err))
        return false;
    advance_incoming(pool, spending);
    return true;
}

/* Replaces textures that are finer than budgeted by coarser ones, while the limits allow. */
static bool shrink_some(struct texture_pool *pool, struct texture_spending *spending,
                        struct error *err)
{
    uint64_t bytes = texture_bytes_to_be(pool);
    for (size_t i = 0; i < pool->request_count && bytes > pool->budget_bytes && !pool->incoming.of;
         i++) {
        struct stored_texture *t = pool->textures[i];
        if (!is_too_fine(t) || texture_spending_is_over(spending))
            continue;
        bytes -= t->full.texture.size_bytes - texture_budgeted_from(t, t->budgeted);
        if (!begin(pool, t, t->budgeted, spending, err))
            return false;
    }
    return true;
}

/* Uploads one step of each listed texture whose levels are in memory, while the limits allow. */
static bool stream_listed(struct texture_pool *pool, size_t count,
                          struct texture_spending *spending, struct error *err)
{
    int unread = 0;
    for (size_t i = 0; i < count && !pool->incoming.of && unread < READ_AHEAD &&
                       !texture_spending_is_over(spending);
         i++) {
        struct stored_texture *t = pool->missing[i];
        uint8_t top = next_top(t);
        bool has_room = false;
        if (!are_read(pool, t, top)) {
            unread++;
            continue;
        }
        if (!make_room(t, top, spending, &has_room, err) ||
            (has_room && !begin(pool, t, top, spending, err)))
            return false;
    }
    return true;
}

/* Makes sure that every texture has a level to draw with, where there is no room for floors. */
static bool stream_first(struct texture_pool *pool, struct texture_spending *spending,
                         struct error *err)
{
    for (size_t i = 0; i < pool->request_count; i++) {
        struct stored_texture *t = pool->textures[i];
        if (texture_is_missing(t) && !texture_present(t) &&
            !texture_replace(t, texture_first_level(t, t->budgeted), spending, err))
            return false;
    }
    return true;
}

/* Whether the upload under way is still needed: it is finer than the resident texture, or coarser
 * if that one is too fine. */
static bool is_of_use(const struct texture_incoming *in)
{
    struct stored_texture *t = in->of;
    return t->budgeted != TEXTURE_UNNEEDED && in->top >= t->budgeted && in->is_packed == t->packs &&
           (in->top < present_top(t) || texture_is_otherwise(t) ||
            (is_too_fine(t) && in->top == t->budgeted));
}

bool texture_stream_some(struct texture_pool *pool, struct texture_spending *spending,
                         struct error *err)
{
    if (pool->incoming.of && !is_of_use(&pool->incoming))
        texture_abandon(&pool->incoming);
    if (!stream_first(pool, spending, err))
        return false;
    advance_incoming(pool, spending);
    bool is_good = shrink_some(pool, spending, err);
    for (uint64_t before = UINT64_MAX; is_good && before != spending->written_bytes;) {
        before = spending->written_bytes;
        is_good = stream_listed(pool, list_missing(pool), spending, err);
    }
    return is_good;
}

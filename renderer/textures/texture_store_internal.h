/* SPDX-License-Identifier: MIT */
/* The parts of the texture pool share this: texture_store.c creates and destroys, texture_budget.c
 * decides which levels fit the budget and what is evicted, texture_upload.c writes the levels of
 * one texture, and texture_stream.c streams in the levels that are missing. A texture holds the
 * levels from its `top` to the last one. To hold finer or coarser levels, a texture of another size
 * takes its place, and copies the levels that both have. Thread: GL. */
#ifndef VITRAIL_RENDERER_TEXTURES_TEXTURE_STORE_INTERNAL_H
#define VITRAIL_RENDERER_TEXTURES_TEXTURE_STORE_INTERNAL_H

#include "renderer/scene/texture_levels.h"
#include "renderer/textures/texture_blocks.h"
#include "renderer/textures/texture_need.h"
#include "renderer/textures/texture_packer.h"
#include "renderer/textures/texture_reader.h"
#include "renderer/textures/texture_store.h"

enum {
    TEXTURE_FIRST_PX = 16, /* side of the levels that a coarse frame begins with: 1.4 kB */
    /* A 64th of the budget keeps such levels of textures that were evicted. */
    TEXTURE_FLOOR_SHARE = 64,
};

struct texture_levels_held {
    struct gl_texture texture; /* unnamed: none */
    uint8_t top;               /* its finest level */
    uint8_t base;              /* the one sampled as the finest: its GL level plus top */
    bool is_packed;            /* compressed; else RGBA8 */
    double mean_square;        /* of its error, in the finest level that was compressed with it */
};

struct stored_texture {
    struct texture_store *store;
    uint32_t key;
    bool is_used, needs_levels;       /* by some sampler; else one level is resident */
    bool can_pack;                    /* colours, on a device that samples blocks */
    bool has_alpha;                   /* which takes other blocks */
    bool packs;                       /* the frame samples it compressed */
    uint32_t width, height;           /* of level 0 */
    uint8_t level_count;              /* of the image */
    struct texture_levels_held full;  /* unnamed with a size: reserved */
    struct texture_levels_held floor; /* what a coarse frame draws with when `full` is not there */
    /* Finest level of the frame: that it can sample, that fits the budget; or TEXTURE_UNNEEDED. */
    uint8_t wanted, budgeted;
    uint64_t last_use;
};

struct texture_incoming { /* a texture in the making, to take the place of one that is drawn with */
    struct gl_texture texture;
    struct stored_texture *of;
    uint32_t row, level; /* the next to be written; rows are of blocks where it is packed */
    uint8_t top;
    bool is_packed;
    struct texture_packed packed; /* levels from top on that are not on the GPU */
};

struct texture_store {
    struct texture_pool *pool;
    const struct scene *scene;
    struct stored_texture *textures; /* by texture_key */
    uint32_t count;
    uint64_t whole_bytes;       /* of all levels that materials sample */
    uint64_t full_bytes;        /* resident, but those of floors ... */
    uint64_t floor_bytes;       /* ... and these */
    uint64_t last_use;          /* as a whole */
    struct texture_store *next; /* of the pool */
};

/* How fast the device takes levels, and what follows. */
struct texture_pace {
    double bytes_per_ms;
    uint64_t chunk_bytes; /* of one call */
};

struct texture_pool {
    uint64_t budget_bytes, upload_bytes, resident_bytes, floor_bytes, clock;
    uint64_t most_bytes; /* resident at once in the last call, for tests */
    double upload_ms;
    bool waits;
    struct texture_pace pace;
    struct texture_reader *reader; /* NULL: nothing was coarse yet */
    struct texture_packer *packer; /* NULL: nothing was compressed yet */
    bool can_pack;                 /* the device samples blocks */
    uint32_t packs_from;           /* levels withheld; 0: never */
    bool packs;                    /* the last request samples colours compressed */
    struct texture_store *stores;
    struct texture_incoming incoming;
    /* Scratch of one call, in its order: textures of the request, then all others. */
    struct stored_texture **textures, **missing;
    size_t count, request_count, capacity;
};

/* How much one call has uploaded, and its limits. */
struct texture_spending {
    uint64_t written_bytes, limit_bytes;
    double begin_ms, limit_ms; /* wall_ms; of the call */
};
bool texture_spending_is_over(const struct texture_spending *spending);

/* ---- texture_upload.c ---- */

/* The bytes of a texture that holds the levels from `top` on. */
uint64_t texture_bytes_from(const struct stored_texture *t, uint32_t top, bool is_packed);
/* The same, in the form that the frame samples. */
static inline uint64_t texture_budgeted_from(const struct stored_texture *t, uint32_t top)
{
    return texture_bytes_from(t, top, t->packs);
}
bool texture_device_packs(void); /* samples compressed sRGB */
static inline uint32_t texture_last_level(const struct stored_texture *t)
{
    return t->level_count - 1u;
}
/* The first level, from `finest` on, with a side of at most TEXTURE_FIRST_PX. */
uint32_t texture_first_level(const struct stored_texture *t, uint32_t finest);
/* What a frame draws with: the full texture, else its floor, else NULL. */
struct texture_levels_held *texture_present(struct stored_texture *t);
const uint8_t *texture_level_pixels(const struct stored_texture *t, uint32_t level);

MUST_CHECK bool texture_measure_pace(struct texture_pace *pace, double upload_ms,
                                     struct error *err);
/* Whether an upload of so many bytes, where limit_bytes were allowed, is long enough to measure
 * the pace by. */
bool texture_pace_is_measured(const struct texture_pace *pace, uint64_t bytes,
                              uint64_t limit_bytes);
/* Learns from a call that uploaded so many bytes in ms, drawing excluded. */
void texture_note_pace(struct texture_pace *pace, double upload_ms, uint64_t bytes, double ms);

/* Whether the level is on the GPU in this form, so that the file need not be read. */
bool texture_has_level(const struct stored_texture *t, uint32_t level, bool is_packed);
/* Finds which compressed levels of such a texture are not on the GPU. False: all of them are. */
bool texture_needs_packing(const struct stored_texture *t, uint32_t top,
                           struct texture_packing *what);
/* Begins the upload of a texture with the levels from `top` on, into the pool's `incoming` or
 * another one. The texture is compressed if the frame samples it so; the call takes `packed`,
 * the blocks that are not on the GPU. */
MUST_CHECK bool texture_begin(struct stored_texture *t, uint32_t top,
                              const struct texture_packed *packed,
                              struct texture_incoming *incoming, struct error *err);
/* Uploads until the texture is complete or the limits of the spending are reached. */
void texture_advance(struct texture_incoming *incoming, struct texture_spending *spending);
bool texture_is_complete(const struct texture_incoming *incoming);
void texture_install(struct texture_incoming *incoming); /* replaces the old texture */
void texture_abandon(struct texture_incoming *incoming);
/* Whether its levels count as resident, but no frame has sampled them so far: they are not on the
 * GPU. */
static inline bool texture_is_reserved(const struct stored_texture *t)
{
    return !t->full.texture.name && t->full.texture.size_bytes > 0;
}
/* All levels of one that holds none. */
void texture_reserve(struct stored_texture *t);
/* Uploads them. Only of one that is reserved. */
MUST_CHECK bool texture_bring_reserved(struct stored_texture *t, struct texture_spending *spending,
                                       struct error *err);
/* Uploads all levels from `top` on in one call, whatever the limits, and waits for compressed
 * blocks. Abandons an upload of the same texture that is under way. */
MUST_CHECK bool texture_replace(struct stored_texture *t, uint32_t top,
                                struct texture_spending *spending, struct error *err);
/* Makes the floor of a texture, if there is room for floors. may_read: the call may read the
 * scene's file. */
MUST_CHECK bool texture_make_floor(struct stored_texture *t, bool may_read, struct error *err);
/* Evicts the full texture. Its coarsest levels stay as a floor if there is room for them. */
MUST_CHECK bool texture_let_go(struct stored_texture *t, struct error *err);
void texture_drop_all(struct stored_texture *t);

/* ---- texture_budget.c ---- */

/* The part of the budget that the levels of a frame may take. */
uint64_t texture_budget_bytes(const struct texture_pool *pool);
/* Sets `budgeted` and `packs` of all textures, from `wanted` of those that the request names. */
MUST_CHECK bool texture_budget_levels(struct texture_pool *pool, bool may_be_coarse,
                                      struct report_textures *report, struct error *err);
bool texture_is_missing(struct stored_texture *t);
bool texture_is_otherwise(const struct stored_texture *t); /* packed and should not be, or should */
/* The bytes that will be resident when all budgeted levels are. */
uint64_t texture_bytes_to_be(const struct texture_pool *pool);
/* The bytes of full textures that the frame does not need. */
uint64_t texture_unneeded_bytes(const struct texture_pool *pool);
/* The least recently used texture that the frame does not need, or NULL. */
struct stored_texture *texture_find_victim(const struct texture_pool *pool);
/* Evicts such textures while they and `bytes` together exceed the budget. */
MUST_CHECK bool texture_drop_unneeded(struct texture_pool *pool, uint64_t bytes, struct error *err);

/* ---- texture_stream.c ---- */

MUST_CHECK bool texture_stream_all(struct texture_pool *pool, struct texture_spending *spending,
                                   struct error *err);
MUST_CHECK bool texture_stream_some(struct texture_pool *pool, struct texture_spending *spending,
                                    struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* Shared by texture_store.c (life), texture_grant.c (what is granted and what goes),
 * texture_upload.c (levels of one texture) and texture_bring.c (what comes). A texture holds the
 * levels from its `top` to the last; finer or coarser ones take a texture of another size, which
 * takes over what both have. Thread: GL. */
#ifndef VITRAIL_RENDERER_TEXTURES_TEXTURE_STORE_INTERNAL_H
#define VITRAIL_RENDERER_TEXTURES_TEXTURE_STORE_INTERNAL_H

#include "renderer/scene/texture_levels.h"
#include "renderer/textures/texture_blocks.h"
#include "renderer/textures/texture_need.h"
#include "renderer/textures/texture_packer.h"
#include "renderer/textures/texture_reader.h"
#include "renderer/textures/texture_store.h"

enum {
    TEXTURE_FIRST_PX = 16,    /* the levels that a coarse frame begins with, 1.4 kB */
    TEXTURE_FLOOR_SHARE = 64, /* one part of so many of the budget is for those of textures that
                                 went */
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
    bool is_used, needs_levels; /* by some sampler; else one level is resident */
    bool can_pack;              /* colours, on a device that samples blocks */
    bool has_alpha;             /* which takes other blocks */
    bool packs;                 /* the frame is granted it so */
    uint32_t width, height;     /* of level 0 */
    uint8_t level_count;        /* of the image */
    struct texture_levels_held full;
    struct texture_levels_held floor; /* what a coarse frame draws with when `full` is not there */
    uint8_t wanted, granted;          /* by the frame, or TEXTURE_UNNEEDED */
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
    bool packs;                    /* the last wish is granted colours so */
    struct texture_store *stores;
    struct texture_incoming incoming;
    /* Scratch of one call, in its order: textures of the wish, then all others. */
    struct stored_texture **textures, **missing;
    size_t count, wish_count, capacity;
};

/* What one call has written, and when it is to stop. */
struct texture_spending {
    uint64_t written_bytes, limit_bytes;
    double begin_ms, limit_ms; /* wall_ms; of the call */
};
bool texture_spending_is_over(const struct texture_spending *spending);

/* ---- texture_upload.c ---- */

/* As a texture of its own, in bytes. */
uint64_t texture_bytes_from(const struct stored_texture *t, uint32_t top, bool is_packed);
/* As the frame is granted it. */
static inline uint64_t texture_granted_from(const struct stored_texture *t, uint32_t top)
{
    return texture_bytes_from(t, top, t->packs);
}
bool texture_device_packs(void); /* samples compressed sRGB */
static inline uint32_t texture_last_level(const struct stored_texture *t)
{
    return t->level_count - 1u;
}
/* From `finest` on the first level that is small. */
uint32_t texture_first_level(const struct stored_texture *t, uint32_t finest);
/* What a frame draws with: the full texture, else its floor, else NULL. */
struct texture_levels_held *texture_present(struct stored_texture *t);
const uint8_t *texture_level_pixels(const struct stored_texture *t, uint32_t level);

MUST_CHECK bool texture_measure_pace(struct texture_pace *pace, double upload_ms,
                                     struct error *err);
/* Whether so many bytes, of as many as were allowed, are enough to tell it. */
bool texture_pace_is_told(const struct texture_pace *pace, uint64_t bytes, uint64_t limit_bytes);
/* A call of so many bytes took so long, drawing excluded. */
void texture_note_pace(struct texture_pace *pace, double upload_ms, uint64_t bytes, double ms);

/* On the GPU in this form, so that it need not be read. */
bool texture_has_level(const struct stored_texture *t, uint32_t level, bool is_packed);
/* What of the blocks of such a texture is not on the GPU: false, all of it is. */
bool texture_needs_packing(const struct stored_texture *t, uint32_t top,
                           struct texture_packing *what);
/* Of a texture with its levels from `top` on, in the pool's `incoming` or one's own; packed where
 * the frame is granted it so, with the blocks that are needed, which it takes. */
MUST_CHECK bool texture_begin(struct stored_texture *t, uint32_t top,
                              const struct texture_packed *packed,
                              struct texture_incoming *incoming, struct error *err);
/* Writes until all is there or the spending is over. */
void texture_advance(struct texture_incoming *incoming, struct texture_spending *spending);
bool texture_is_complete(const struct texture_incoming *incoming);
void texture_install(struct texture_incoming *incoming); /* in the place of what was there */
void texture_abandon(struct texture_incoming *incoming);
/* All of these in one call, whatever is spent; waits for blocks. Abandons what comes for it. */
MUST_CHECK bool texture_replace(struct stored_texture *t, uint32_t top,
                                struct texture_spending *spending, struct error *err);
/* Where there is room for floors; `may_read`: of the scene's file. */
MUST_CHECK bool texture_make_floor(struct stored_texture *t, bool may_read, struct error *err);
/* Lets the full texture go; its coarsest levels stay as a floor where there is room for them. */
MUST_CHECK bool texture_let_go(struct stored_texture *t, struct error *err);
void texture_drop_all(struct stored_texture *t);

/* ---- texture_grant.c ---- */

/* Of the budget, what frames may be granted. */
uint64_t texture_grant_budget(const struct texture_pool *pool);
/* Sets `granted` and `packs` of all, from what `wanted` of the wish's is. */
MUST_CHECK bool texture_grant(struct texture_pool *pool, bool may_be_coarse,
                              struct report_textures *report, struct error *err);
bool texture_is_missing(struct stored_texture *t);
bool texture_is_otherwise(const struct stored_texture *t); /* packed and should not be, or should */
/* With all that is granted, and what is there of textures of the wish that need no change. */
uint64_t texture_bytes_to_be(const struct texture_pool *pool);
/* Of full textures that the frame has no need of. */
uint64_t texture_unneeded_bytes(const struct texture_pool *pool);
/* Whom the frame does not need and who was used least recently; NULL: nobody. */
struct stored_texture *texture_find_victim(const struct texture_pool *pool);
/* Lets those go while so many bytes and theirs are above the budget. */
MUST_CHECK bool texture_drop_unneeded(struct texture_pool *pool, uint64_t bytes, struct error *err);

/* ---- texture_bring.c ---- */

MUST_CHECK bool texture_bring_all(struct texture_pool *pool, struct texture_spending *spending,
                                  struct error *err);
MUST_CHECK bool texture_bring_some(struct texture_pool *pool, struct texture_spending *spending,
                                   struct error *err);

#endif

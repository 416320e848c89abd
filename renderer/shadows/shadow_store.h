/* SPDX-License-Identifier: MIT */
/* The memory of all shadow structures: pools of opaque depths, list heads, events and elements, all
 * under one budget. Maps take ranges and give them back; pools grow by
 * re-creation with copy. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_STORE_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_STORE_H

#include "renderer/gl/context.h"
#include "renderer/gl/object.h"
#include "renderer/shadows/shadow_ranges.h"

enum shadow_pool_kind {
    SHADOW_POOL_DEPTHS, /* f32 per texel: nearest opaque caster, as a reversed depth; 0 for none */
    SHADOW_POOL_HEADS,  /* u32 per texel: list offsets, or heads of linked lists */
    SHADOW_POOL_EVENTS, /* depth and transmittance of each event, the index of its list, and, where
                           kept, its object, and the extinction behind it */
    SHADOW_POOL_NODES,  /* 16-byte elements of linked lists */
    SHADOW_POOL_TEXELS, /* four floats per texel, by techniques without lists: shadow_texels.h */
    SHADOW_POOL_COUNT
};

enum { SHADOW_STREAMS_MAX = 4 };
/* Of a target between builds: a cube of 1024 texels. */
enum { SHADOW_TARGET_KEPT_BYTES = 32 << 20 };
/* Of SHADOW_POOL_EVENTS. */
enum shadow_stream {
    SHADOW_STREAM_EVENT,
    SHADOW_STREAM_KEYS,   /* 2 bytes per event: SHADOW_KEYS_AT of records.h */
    SHADOW_STREAM_OBJECT, /* u32; these two exist once a map asked for them */
    SHADOW_STREAM_MEDIUM, /* four words: extinction [1/m] as rgb floats */
};

struct shadow_pool {
    struct shadow_ranges ranges;
    struct gl_buffer streams[SHADOW_STREAMS_MAX];
    struct gl_texture views[SHADOW_STREAMS_MAX]; /* the streams as texels, for reading */
};

struct shadow_framebuffers {      /* made when they are first asked for */
    struct gl_framebuffer layers; /* of all layers, ... */
    struct gl_framebuffer *faces; /* ... and one of each */
};

struct shadow_store {
    const struct gl_limits *limits;
    uint64_t budget_bytes;
    uint64_t transient_bytes;        /* of builders, counted against the budget while they last */
    bool keeps_objects, keeps_media; /* SHADOW_STREAM_OBJECT, SHADOW_STREAM_MEDIUM exist */
    struct shadow_pool pools[SHADOW_POOL_COUNT];
    struct gl_texture target; /* D32F layers that faces are drawn into, for the length of a build */
    struct gl_texture colors; /* RGBA32F, as many layers: where a structure has texels */
    struct shadow_framebuffers framebuffers[2]; /* of the target; 1: with its colours */
    /* Frees the map used longest ago, at least so many frames; false when there is none. */
    bool (*make_room)(void *context, uint64_t frames);
    void *context;
    /* Most that the store and its builders took at once, since shadow_store_clear. */
    uint64_t peak_bytes;
    /* Optional: called before the store allocates so many bytes more, within its budget. */
    void (*reserve)(void *context, uint64_t bytes);
    void *reserve_context;
};

/* Frees all device memory; every allocated range becomes invalid. */
void shadow_store_clear(struct shadow_store *store);
uint64_t shadow_store_size_bytes(const struct shadow_store *store);

/* ERROR_OVER_BUDGET names the bytes needed and the budget, or the elements needed and those that
 * the device reads from one pool. */
MUST_CHECK bool shadow_store_take(struct shadow_store *store, enum shadow_pool_kind kind,
                                  uint64_t count, struct shadow_range *range, struct error *err);
/* Makes a pool large enough for ranges of so many elements, where the budget allows it, as taking
 * them does: growing at most once, so that what stands is copied once and not for every range. */
MUST_CHECK bool shadow_store_reserve(struct shadow_store *store, enum shadow_pool_kind kind,
                                     const uint64_t *counts, size_t count, struct error *err);
/* Gives back to the device what pools hold for nobody: all of an empty one, and the end of one that
 * is half empty there. */
MUST_CHECK bool shadow_store_trim(struct shadow_store *store, struct error *err);
/* Whether depths, list heads and texels of so many can be resident at once at all: asked before
 * anything is built. ERROR_OVER_BUDGET as above. */
MUST_CHECK bool shadow_store_check_frame(const struct shadow_store *store, uint64_t depths,
                                         uint64_t heads, uint64_t texels, struct error *err);
MUST_CHECK bool shadow_store_free(struct shadow_store *store, enum shadow_pool_kind kind,
                                  struct shadow_range *range, struct error *err);
/* Makes store->target at least so many layers of this resolution; its contents are lost. */
MUST_CHECK bool shadow_store_reserve_target(struct shadow_store *store, int resolution,
                                            uint64_t layers, struct error *err);
/* Makes store->colors beside the target, which stands. */
MUST_CHECK bool shadow_store_reserve_colors(struct shadow_store *store, struct error *err);
/* Framebuffers of the target: of all layers at once, and of one. They last as long as it does.
 * has_colors: and of store->colors, which stand. */
const struct gl_framebuffer *shadow_store_layers(struct shadow_store *store, bool has_colors,
                                                 struct error *err);
const struct gl_framebuffer *shadow_store_face(struct shadow_store *store, uint32_t layer,
                                               bool has_colors, struct error *err);
/* Frees a target that is too large to keep for the next edit, or any. */
void shadow_store_trim_target(struct shadow_store *store);
void shadow_store_drop_target(struct shadow_store *store);
/* Adds this optional stream to events, from now on. */
MUST_CHECK bool shadow_store_keep(struct shadow_store *store, enum shadow_stream stream,
                                  struct error *err);
/* Makes sure that a builder's transient memory fits beside what is resident. */
MUST_CHECK bool shadow_store_check_transient(struct shadow_store *store, uint64_t bytes,
                                             struct error *err);

/* Elements of a pool that a storage block of the device takes at once are a span. It begins at a
 * multiple of this, where an offset into every stream may be. */
enum { SHADOW_SPAN_GRAIN = 128 };
/* Makes the span hold the range, too; an empty one takes any, which is to
 * fit: shadow_store_block. False, and it stays as it was, where
 * it would exceed a storage block then. */
bool shadow_store_widen(const struct shadow_store *store, enum shadow_pool_kind kind,
                        const struct shadow_range *range, struct shadow_range *span);
/* Elements that a storage block of the device takes, wherever in the pool they begin. */
uint64_t shadow_store_block(const struct shadow_store *store, enum shadow_pool_kind kind);
/* Likewise, of what can only be written at once (gl_limits_whole_block). */
uint64_t shadow_store_whole_block(const struct shadow_store *store, enum shadow_pool_kind kind);
/* ERROR_OVER_BUDGET where the light has more elements than that. */
MUST_CHECK bool shadow_store_check_block(const struct shadow_store *store,
                                         enum shadow_pool_kind kind, uint64_t count, uint32_t light,
                                         struct error *err);
MUST_CHECK bool shadow_store_check_whole_block(const struct shadow_store *store,
                                               enum shadow_pool_kind kind, uint64_t count,
                                               uint32_t light, struct error *err);
/* Binds a stream's part in the span as storage: element 0 is then the first of the span. */
void shadow_store_bind(const struct shadow_store *store, enum shadow_pool_kind kind, int stream,
                       const struct shadow_range *span, uint32_t binding);

const struct gl_texture *shadow_store_view(const struct shadow_store *store,
                                           enum shadow_pool_kind kind, int stream);

#endif

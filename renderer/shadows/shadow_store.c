/* SPDX-License-Identifier: MIT */
/* Pools and atlases under one budget. */
#include "renderer/shadows/shadow_store.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>

struct stream_kind {
    const char *label;
    GLenum format;
    uint32_t bytes;
    uint32_t shared_by; /* elements of the pool that share one of the stream; 0 means 1 */
};

static const struct stream_kind stream_kinds[SHADOW_POOL_COUNT][SHADOW_STREAMS_MAX] = {
    {{"shadow.depths", GL_R32F, 4, 0}},
    {{"shadow.heads", GL_R32UI, 4, 0}},
    {{"shadow.deep.events", GL_RGBA32F, 16, 0},
     {"shadow.deep.keys", GL_RGBA32UI, 16, 8},
     {"shadow.deep.objects", GL_R32UI, 4, 0},
     {"shadow.deep.media", GL_RGBA32UI, 16, 0}},
    {{"shadow.linked.nodes", GL_RGBA32UI, 16, 0}},
    {{"shadow.texels", GL_RGBA32F, 16, 0}},
};

static bool has_stream(const struct shadow_store *store, enum shadow_pool_kind kind, int stream)
{
    if (kind != SHADOW_POOL_EVENTS)
        return stream == 0;
    if (stream == SHADOW_STREAM_OBJECT)
        return store->keeps_objects;
    return stream != SHADOW_STREAM_MEDIUM || store->keeps_media;
}

/* Of a stream with room for so many elements of its pool. */
static uint64_t stream_bytes(const struct stream_kind *kind, uint64_t capacity)
{
    return kind->shared_by ? (capacity / kind->shared_by + 1) * kind->bytes
                           : capacity * kind->bytes;
}

static uint64_t pool_bytes(const struct shadow_store *store, enum shadow_pool_kind kind,
                           uint64_t capacity)
{
    uint64_t bytes = 0;
    for (int i = 0; i < SHADOW_STREAMS_MAX; i++)
        if (has_stream(store, kind, i))
            bytes += stream_bytes(&stream_kinds[kind][i], capacity);
    return bytes;
}

static void finish_pool(struct shadow_pool *pool)
{
    for (int i = 0; i < SHADOW_STREAMS_MAX; i++) {
        gl_texture_finish(&pool->views[i]);
        gl_buffer_finish(&pool->streams[i]);
    }
    shadow_ranges_finish(&pool->ranges);
}

static void finish_framebuffers(struct shadow_store *store, bool has_colors)
{
    struct shadow_framebuffers *framebuffers = &store->framebuffers[has_colors];
    for (int i = 0; framebuffers->faces && i < store->target.layers; i++)
        gl_framebuffer_finish(&framebuffers->faces[i]);
    free(framebuffers->faces);
    framebuffers->faces = NULL;
    gl_framebuffer_finish(&framebuffers->layers);
}

static void finish_colors(struct shadow_store *store)
{
    finish_framebuffers(store, true);
    gl_texture_finish(&store->colors);
}

static void finish_target(struct shadow_store *store)
{
    finish_colors(store);
    finish_framebuffers(store, false);
    gl_texture_finish(&store->target);
}

void shadow_store_clear(struct shadow_store *store)
{
    for (int i = 0; i < SHADOW_POOL_COUNT; i++)
        finish_pool(&store->pools[i]);
    finish_target(store);
    store->keeps_objects = store->keeps_media = false;
    store->peak_bytes = 0;
}

uint64_t shadow_store_size_bytes(const struct shadow_store *store)
{
    uint64_t bytes = 0;
    for (int kind = 0; kind < SHADOW_POOL_COUNT; kind++)
        for (int i = 0; i < SHADOW_STREAMS_MAX; i++)
            bytes += store->pools[kind].streams[i].size_bytes;
    return bytes + store->target.size_bytes + store->colors.size_bytes;
}

/* To be called before so many bytes more are allocated. */
static void reserve(struct shadow_store *store, uint64_t more_bytes)
{
    uint64_t bytes = shadow_store_size_bytes(store) + store->transient_bytes + more_bytes;
    if (bytes > store->peak_bytes)
        store->peak_bytes = bytes;
    if (store->reserve)
        store->reserve(store->reserve_context, store->transient_bytes + more_bytes);
}

static bool fits(const struct shadow_store *store, uint64_t more_bytes)
{
    uint64_t used = shadow_store_size_bytes(store) + store->transient_bytes;
    return used <= store->budget_bytes && more_bytes <= store->budget_bytes - used;
}

static bool over_budget(const struct shadow_store *store, uint64_t more_bytes, const char *what,
                        struct error *err)
{
    uint64_t used = shadow_store_size_bytes(store) + store->transient_bytes;
    return error_set(
        err, ERROR_OVER_BUDGET, "shadows need %llu bytes with %s, the budget is %llu bytes",
        (unsigned long long)(used + more_bytes), what, (unsigned long long)store->budget_bytes);
}

static bool make_room(struct shadow_store *store)
{
    return store->make_room && store->make_room(store->context, 1);
}

/* Before a pool grows: edits leave a trail of maps that nobody asks for again. */
static bool drop_stale(struct shadow_store *store)
{
    const uint64_t frames = 64; /* more than the views that are usually open on one scene */
    return store->make_room && store->make_room(store->context, frames);
}

/* Elements that one pool may have: shaders read it as a texture, and index floats with 32 bits. */
static uint64_t most_elements(const struct shadow_store *store)
{
    uint64_t texels = (uint64_t)store->limits->max_texture_buffer_texels;
    return texels < UINT32_MAX / 4 ? texels : UINT32_MAX / 4;
}

/* Half again of what there is, where budget and device allow it, so that growth by copies stays
 * linear. */
static uint64_t choose_capacity(const struct shadow_store *store, enum shadow_pool_kind kind,
                                uint64_t need)
{
    uint64_t capacity = store->pools[kind].ranges.capacity;
    uint64_t ample = capacity + capacity / 2, most = most_elements(store);
    if (shadow_ranges_is_empty(&store->pools[kind].ranges))
        return need; /* nothing is to be copied */
    if (ample > most)
        ample = most;
    if (ample <= need)
        return need;
    uint64_t more_bytes = pool_bytes(store, kind, ample) - pool_bytes(store, kind, capacity);
    return fits(store, more_bytes) ? ample : need;
}

/* Heads are written from the host where the device is our own cores. */
static bool resize_stream(struct shadow_pool *pool, const struct stream_kind *kind, int stream,
                          uint64_t capacity, bool is_software, struct error *err)
{
    struct gl_buffer *old = &pool->streams[stream];
    struct gl_buffer fresh = {.storage = old->storage};
    struct gl_texture view = {0};
    struct gl_buffer_desc desc = {.label = kind->label,
                                  .size_bytes = stream_bytes(kind, capacity),
                                  .is_dynamic = kind->format == GL_R32UI && is_software};
    if (!gl_buffer_init(&fresh, &desc, err))
        return false;
    if (!gl_texture_init_buffer(&view, kind->label, kind->format, &fresh, err)) {
        gl_buffer_finish(&fresh);
        return false;
    }
    if (old->name)
        gl_buffer_copy(old, 0, &fresh, 0,
                       old->size_bytes < fresh.size_bytes ? old->size_bytes : fresh.size_bytes);
    gl_texture_finish(&pool->views[stream]);
    gl_buffer_finish(old);
    *old = fresh;
    pool->views[stream] = view;
    return true;
}

static bool resize_pool(struct shadow_store *store, enum shadow_pool_kind kind, uint64_t capacity,
                        struct error *err)
{
    struct shadow_pool *pool = &store->pools[kind];
    for (int i = 0; i < SHADOW_STREAMS_MAX; i++)
        if (has_stream(store, kind, i) && !resize_stream(pool, &stream_kinds[kind][i], i, capacity,
                                                         store->limits->is_software, err))
            return false;
    return true;
}

/* The old memory of an empty pool goes before the new comes: never are both there. */
static bool grow_pool(struct shadow_store *store, enum shadow_pool_kind kind, uint64_t capacity,
                      struct error *err)
{
    struct shadow_pool *pool = &store->pools[kind];
    if (shadow_ranges_is_empty(&pool->ranges))
        finish_pool(pool);
    reserve(store,
            pool_bytes(store, kind, capacity) - pool_bytes(store, kind, pool->ranges.capacity));
    return resize_pool(store, kind, capacity, err) &&
           shadow_ranges_grow(&pool->ranges, capacity, err);
}

bool shadow_store_reserve(struct shadow_store *store, enum shadow_pool_kind kind,
                          const uint64_t *counts, size_t count, struct error *err)
{
    const struct shadow_ranges *ranges = &store->pools[kind].ranges;
    for (;;) {
        uint64_t need;
        if (!shadow_ranges_capacity_for_all(ranges, counts, count, &need, err))
            return false;
        if (need <= ranges->capacity)
            return true;
        if (drop_stale(store))
            continue;
        uint64_t wanted = choose_capacity(store, kind, need);
        if (need <= most_elements(store) &&
            fits(store,
                 pool_bytes(store, kind, wanted) - pool_bytes(store, kind, ranges->capacity)))
            return grow_pool(store, kind, wanted, err);
        if (!make_room(store))
            return true; /* taking them says what is missing */
    }
}

/* Gives the end of a pool back, that nobody has. */
static bool trim_pool(struct shadow_store *store, enum shadow_pool_kind kind, struct error *err)
{
    struct shadow_pool *pool = &store->pools[kind];
    uint64_t before = pool->ranges.capacity;
    if (shadow_ranges_is_empty(&pool->ranges)) {
        finish_pool(pool);
        return true;
    }
    shadow_ranges_trim(&pool->ranges);
    return pool->ranges.capacity == before || resize_pool(store, kind, pool->ranges.capacity, err);
}

static bool trim_pools(struct shadow_store *store, struct error *err)
{
    for (int kind = 0; kind < SHADOW_POOL_COUNT; kind++)
        if (!trim_pool(store, (enum shadow_pool_kind)kind, err))
            return false;
    return true;
}

bool shadow_store_trim(struct shadow_store *store, struct error *err)
{
    bool has_any = false;
    for (int kind = 0; kind < SHADOW_POOL_COUNT; kind++) {
        const struct shadow_ranges *ranges = &store->pools[kind].ranges;
        has_any |= !shadow_ranges_is_empty(ranges);
        if (shadow_ranges_capacity_for(ranges, ranges->capacity) <=
                ranges->capacity + ranges->capacity / 2 &&
            !trim_pool(store, (enum shadow_pool_kind)kind, err))
            return false; /* else more than half is in front of the last that is taken */
    }
    if (!has_any)
        shadow_store_clear(store);
    return true;
}

/* What was used longest ago goes, and then what pools grew beyond their last structure: by how much
 * depends on the order in which others came and went, and is to refuse nothing. */
static bool find_room(struct shadow_store *store, uint64_t bytes, const char *what,
                      struct error *err)
{
    while (!fits(store, bytes) && make_room(store))
        continue;
    return fits(store, bytes) || (trim_pools(store, err) && fits(store, bytes)) ||
           over_budget(store, bytes, what, err);
}

bool shadow_store_take(struct shadow_store *store, enum shadow_pool_kind kind, uint64_t count,
                       struct shadow_range *range, struct error *err)
{
    enum { LEAST = 4096 }; /* elements of a pool's first buffer */
    struct shadow_pool *pool = &store->pools[kind];
    uint64_t most = most_elements(store);
    bool is_trimmed = false;
    if (count > most)
        return error_set(
            err, ERROR_OVER_BUDGET, "one light needs %llu elements of '%s', this device reads %llu",
            (unsigned long long)count, stream_kinds[kind][0].label, (unsigned long long)most);
    for (;;) {
        if (shadow_ranges_take(&pool->ranges, count, range))
            return true;
        if (drop_stale(store))
            continue;
        uint64_t need = shadow_ranges_capacity_for(&pool->ranges, count);
        if (need > most) {
            if (make_room(store))
                continue;
            return error_set(err, ERROR_OVER_BUDGET,
                             "the lights together need %llu elements of '%s', this device reads "
                             "%llu: lower quality.shadow_resolution",
                             (unsigned long long)need, stream_kinds[kind][0].label,
                             (unsigned long long)most);
        }
        uint64_t wanted = choose_capacity(store, kind, need < LEAST ? LEAST : need);
        uint64_t more_bytes =
            pool_bytes(store, kind, wanted) - pool_bytes(store, kind, pool->ranges.capacity);
        if (fits(store, more_bytes)) {
            if (!grow_pool(store, kind, wanted, err))
                return false;
        } else if (!make_room(store)) {
            if (is_trimmed)
                return over_budget(store, more_bytes, stream_kinds[kind][0].label, err);
            if (!trim_pools(store, err))
                return false;
            is_trimmed = true;
        }
    }
}

bool shadow_store_check_frame(const struct shadow_store *store, uint64_t depths, uint64_t heads,
                              uint64_t texels, struct error *err)
{
    uint64_t most = most_elements(store), bytes = 4 * (depths + heads) + 16 * texels;
    if (depths > most || heads > most || texels > most)
        return error_set(err, ERROR_OVER_BUDGET,
                         "shadow maps of %llu texels are asked for, this device reads %llu: lower "
                         "quality.shadow_resolution",
                         (unsigned long long)depths, (unsigned long long)most);
    if (bytes > store->budget_bytes)
        return error_set(err, ERROR_OVER_BUDGET,
                         "shadow maps of %llu texels need %llu bytes, the budget is %llu bytes",
                         (unsigned long long)depths, (unsigned long long)bytes,
                         (unsigned long long)store->budget_bytes);
    return true;
}

bool shadow_store_free(struct shadow_store *store, enum shadow_pool_kind kind,
                       struct shadow_range *range, struct error *err)
{
    return shadow_ranges_free(&store->pools[kind].ranges, range, err);
}

bool shadow_store_reserve_target(struct shadow_store *store, int resolution, uint64_t layers,
                                 struct error *err)
{
    struct gl_texture *target = &store->target;
    uint64_t bytes = 4ull * layers * (uint64_t)resolution * (uint64_t)resolution;
    if (target->name && target->width == resolution && (uint64_t)target->layers >= layers)
        return true;
    finish_target(store);
    if (!find_room(store, bytes, "shadow.target", err))
        return false;
    reserve(store, bytes);
    return gl_texture_init(target,
                           &(struct gl_texture_desc){.label = "shadow.target",
                                                     .format = GL_DEPTH_COMPONENT32F,
                                                     .width = resolution,
                                                     .height = resolution,
                                                     .layers = (int)layers},
                           err);
}

bool shadow_store_reserve_colors(struct shadow_store *store, struct error *err)
{
    const struct gl_texture *target = &store->target;
    uint64_t side = (uint64_t)target->width, bytes = 16 * (uint64_t)target->layers * side * side;
    if (store->colors.name)
        return true;
    if (!find_room(store, bytes, "shadow.colors", err))
        return false;
    reserve(store, bytes);
    return gl_texture_init(&store->colors,
                           &(struct gl_texture_desc){.label = "shadow.colors",
                                                     .format = GL_RGBA32F,
                                                     .width = target->width,
                                                     .height = target->height,
                                                     .layers = target->layers},
                           err);
}

const struct gl_framebuffer *shadow_store_layers(struct shadow_store *store, bool has_colors,
                                                 struct error *err)
{
    struct gl_framebuffer *layers = &store->framebuffers[has_colors].layers;
    const struct gl_framebuffer_desc desc = {.label = "shadow.faces",
                                             .colors = {has_colors ? &store->colors : NULL},
                                             .depth = &store->target,
                                             .is_layered = true};
    return layers->name || gl_framebuffer_init(layers, &desc, err) ? layers : NULL;
}

const struct gl_framebuffer *shadow_store_face(struct shadow_store *store, uint32_t layer,
                                               bool has_colors, struct error *err)
{
    struct shadow_framebuffers *framebuffers = &store->framebuffers[has_colors];
    const struct gl_framebuffer_desc desc = {.label = "shadow.face",
                                             .colors = {has_colors ? &store->colors : NULL},
                                             .depth = &store->target,
                                             .layer = (int)layer};
    assert((int)layer < store->target.layers);
    if (!framebuffers->faces)
        framebuffers->faces = calloc((size_t)store->target.layers, sizeof *framebuffers->faces);
    if (!framebuffers->faces) {
        error_set(err, ERROR_NO_MEMORY, "%d framebuffers", store->target.layers);
        return NULL;
    }
    struct gl_framebuffer *face = &framebuffers->faces[layer];
    return face->name || gl_framebuffer_init(face, &desc, err) ? face : NULL;
}

void shadow_store_trim_target(struct shadow_store *store)
{
    if (store->target.size_bytes + store->colors.size_bytes > SHADOW_TARGET_KEPT_BYTES)
        finish_target(store);
}

void shadow_store_drop_target(struct shadow_store *store)
{
    finish_target(store);
}

bool shadow_store_keep(struct shadow_store *store, enum shadow_stream stream, struct error *err)
{
    struct shadow_pool *pool = &store->pools[SHADOW_POOL_EVENTS];
    const struct stream_kind *kind = &stream_kinds[SHADOW_POOL_EVENTS][stream];
    bool *keeps = stream == SHADOW_STREAM_OBJECT ? &store->keeps_objects : &store->keeps_media;
    if (*keeps)
        return true;
    if (!find_room(store, stream_bytes(kind, pool->ranges.capacity), kind->label, err))
        return false;
    reserve(store, stream_bytes(kind, pool->ranges.capacity));
    if (pool->ranges.capacity && !resize_stream(pool, kind, (int)stream, pool->ranges.capacity,
                                                store->limits->is_software, err))
        return false;
    *keeps = true;
    return true;
}

bool shadow_store_check_transient(struct shadow_store *store, uint64_t bytes, struct error *err)
{
    if (!find_room(store, bytes, "the memory of their construction", err))
        return false;
    reserve(store, bytes);
    return true;
}

/* Bytes of an element in the widest stream of its pool. */
static uint64_t widest_bytes(const struct shadow_store *store, enum shadow_pool_kind kind)
{
    uint64_t widest = 0;
    for (int i = 0; i < SHADOW_STREAMS_MAX; i++)
        if (has_stream(store, kind, i) && !stream_kinds[kind][i].shared_by &&
            stream_kinds[kind][i].bytes > widest)
            widest = stream_kinds[kind][i].bytes;
    return widest;
}

/* A span may begin almost a grain before them. */
uint64_t shadow_store_block(const struct shadow_store *store, enum shadow_pool_kind kind)
{
    return gl_limits_block(store->limits, widest_bytes(store, kind)) - SHADOW_SPAN_GRAIN;
}

uint64_t shadow_store_whole_block(const struct shadow_store *store, enum shadow_pool_kind kind)
{
    return gl_limits_whole_block(store->limits, widest_bytes(store, kind)) - SHADOW_SPAN_GRAIN;
}

static bool refuse_block(const struct shadow_store *store, enum shadow_pool_kind kind,
                         uint64_t count, int64_t most_bytes, uint32_t light, struct error *err)
{
    return error_set(err, ERROR_OVER_BUDGET,
                     "light %u needs %llu bytes of '%s' in one storage block, this device has "
                     "%lld: lower quality.shadow_resolution",
                     light, (unsigned long long)(count * widest_bytes(store, kind)),
                     stream_kinds[kind][0].label, (long long)most_bytes);
}

bool shadow_store_check_block(const struct shadow_store *store, enum shadow_pool_kind kind,
                              uint64_t count, uint32_t light, struct error *err)
{
    return count <= shadow_store_block(store, kind) ||
           refuse_block(store, kind, count, store->limits->max_storage_block_bytes, light, err);
}

bool shadow_store_check_whole_block(const struct shadow_store *store, enum shadow_pool_kind kind,
                                    uint64_t count, uint32_t light, struct error *err)
{
    return count <= shadow_store_whole_block(store, kind) ||
           refuse_block(store, kind, count, store->limits->max_whole_block_bytes, light, err);
}

bool shadow_store_widen(const struct shadow_store *store, enum shadow_pool_kind kind,
                        const struct shadow_range *range, struct shadow_range *span)
{
    uint64_t first = range->first, end = range->first + range->count;
    if (!range->count)
        return true;
    if (span->count && span->first < first)
        first = span->first;
    if (span->count && span->first + span->count > end)
        end = span->first + span->count;
    first -= first % SHADOW_SPAN_GRAIN;
    if (span->count && (end - first) > gl_limits_block(store->limits, widest_bytes(store, kind)))
        return false;
    *span = (struct shadow_range){first, end - first};
    return true;
}

void shadow_store_bind(const struct shadow_store *store, enum shadow_pool_kind kind, int stream,
                       const struct shadow_range *span, uint32_t binding)
{
    const struct stream_kind *form = &stream_kinds[kind][stream];
    uint64_t shared_by = form->shared_by ? form->shared_by : 1;
    gl_buffer_bind_storage_range(&store->pools[kind].streams[stream],
                                 span->first / shared_by * form->bytes,
                                 stream_bytes(form, span->count), binding);
}

const struct gl_texture *shadow_store_view(const struct shadow_store *store,
                                           enum shadow_pool_kind kind, int stream)
{
    return &store->pools[kind].views[stream];
}

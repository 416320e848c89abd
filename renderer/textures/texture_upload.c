/* SPDX-License-Identifier: MIT */
/* The levels of one texture: their sizes, their upload in chunks of rows, and its pace. */
#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/wall_clock.h"
#include "renderer/textures/texture_store_internal.h"

enum {
    CHUNK_LEAST = 64 << 10, /* a row of the widest texture that devices take */
    CHUNK_MOST = 1 << 20,
    CHUNKS_A_FRAME = 4, /* so that the last one is little beside the limit */
    PROBE_SIDE = 512,   /* px: 1 MiB */
    PROBES = 3,
};
static const double PACE_SHARE = 0.25; /* of the last frame in the running mean */

bool texture_spending_is_over(const struct texture_spending *spending)
{
    return spending->written_bytes >= spending->limit_bytes ||
           (spending->limit_ms < INFINITY && wall_ms() - spending->begin_ms >= spending->limit_ms);
}

/* ---- sizes ---- */

static uint64_t levels_bytes(const struct stored_texture *t, uint32_t first, bool is_packed)
{
    return is_packed ? texture_blocks_bytes(t->width, t->height, first, t->has_alpha)
                     : texture_levels_bytes(t->width, t->height, first);
}

uint64_t texture_bytes_from(const struct stored_texture *t, uint32_t top, bool is_packed)
{
    uint64_t from = levels_bytes(t, top, is_packed);
    return t->needs_levels ? from : from - levels_bytes(t, top + 1, is_packed);
}

bool texture_device_packs(void)
{
    return epoxy_has_gl_extension("GL_EXT_texture_compression_s3tc") &&
           (epoxy_has_gl_extension("GL_EXT_texture_sRGB") ||
            epoxy_has_gl_extension("GL_EXT_texture_compression_s3tc_srgb"));
}

uint32_t texture_first_level(const struct stored_texture *t, uint32_t finest)
{
    uint32_t level = finest;
    while (level < texture_last_level(t) &&
           texture_level_side(t->width, level) > TEXTURE_FIRST_PX &&
           texture_level_side(t->height, level) > TEXTURE_FIRST_PX)
        level++;
    return level;
}

struct texture_levels_held *texture_present(struct stored_texture *t)
{
    return t->full.texture.name ? &t->full : t->floor.texture.name ? &t->floor : NULL;
}

const uint8_t *texture_level_pixels(const struct stored_texture *t, uint32_t level)
{
    const struct scene *scene = t->store->scene;
    const struct scene_image *image = &scene->images[t->key / 2];
    if (level == 0)
        return scene->pixels + image->offset_bytes;
    return scene->pixels + image->levels_offset_bytes[t->key & 1] +
           texture_levels_bytes(t->width, t->height, 1) -
           texture_levels_bytes(t->width, t->height, level);
}

/* ---- pace ---- */

static void set_chunk(struct texture_pace *pace, double upload_ms)
{
    double bytes = pace->bytes_per_ms * upload_ms / CHUNKS_A_FRAME;
    pace->chunk_bytes = bytes < CHUNK_LEAST  ? CHUNK_LEAST
                        : bytes > CHUNK_MOST ? CHUNK_MOST
                                             : (uint64_t)bytes;
}

/* A call uploads whole rows, at least one, and so half a chunk or more. A smaller call would
 * measure the overhead of calls and not the pace of bytes, unless the limit itself is less than a
 * row. */
bool texture_pace_is_measured(const struct texture_pace *pace, uint64_t bytes, uint64_t limit_bytes)
{
    return bytes > 0 && (bytes >= pace->chunk_bytes / 2 || bytes >= limit_bytes);
}

void texture_note_pace(struct texture_pace *pace, double upload_ms, uint64_t bytes, double ms)
{
    double found = (double)bytes / fmax(ms, 1e-3);
    if (ms > upload_ms && found < pace->bytes_per_ms) /* too long: at once, but by half at most */
        pace->bytes_per_ms = fmax(found, pace->bytes_per_ms / 2);
    else
        pace->bytes_per_ms += PACE_SHARE * (found - pace->bytes_per_ms);
    set_chunk(pace, upload_ms);
}

static bool probe(const void *pixels, double *ms, struct error *err)
{
    struct gl_texture texture = {0};
    glFinish();
    double begin_ms = wall_ms();
    if (!gl_texture_init(&texture,
                         &(struct gl_texture_desc){.label = "scene.probe",
                                                   .format = GL_SRGB8_ALPHA8,
                                                   .width = PROBE_SIDE,
                                                   .height = PROBE_SIDE},
                         err))
        return false;
    glTextureSubImage2D(texture.name, 0, 0, 0, PROBE_SIDE, PROBE_SIDE, GL_RGBA, GL_UNSIGNED_BYTE,
                        pixels);
    glFinish();
    double taken_ms = wall_ms() - begin_ms;
    *ms = fmin(*ms, taken_ms);
    gl_texture_finish(&texture);
    return true;
}

bool texture_measure_pace(struct texture_pace *pace, double upload_ms, struct error *err)
{
    size_t bytes = 4 * PROBE_SIDE * PROBE_SIDE;
    double ms = INFINITY;
    void *pixels = malloc(bytes);
    if (!pixels)
        return error_set(err, ERROR_NO_MEMORY, "measuring uploads");
    memset(pixels, 127, bytes);
    bool is_good = true;
    for (int i = 0; is_good && i < PROBES; i++)
        is_good = probe(pixels, &ms, err);
    free(pixels);
    pace->bytes_per_ms = (double)bytes / fmax(ms, 1e-3);
    set_chunk(pace, upload_ms);
    return is_good;
}

/* ---- textures ---- */

static GLenum blocks_format(const struct stored_texture *t)
{
    return t->has_alpha ? GL_COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT : GL_COMPRESSED_SRGB_S3TC_DXT1_EXT;
}

static void count_in(struct stored_texture *t, struct gl_texture *texture, uint64_t bytes)
{
    struct texture_pool *pool = t->store->pool;
    texture->size_bytes = bytes;
    pool->resident_bytes += bytes;
    t->store->full_bytes += bytes;
    if (pool->most_bytes < pool->resident_bytes)
        pool->most_bytes = pool->resident_bytes;
}

static bool make_texture(struct stored_texture *t, uint32_t top, bool is_packed,
                         struct gl_texture *texture, struct error *err)
{
    if (!gl_texture_init(texture,
                         &(struct gl_texture_desc){
                             .label = "scene.image",
                             .format = is_packed    ? blocks_format(t)
                                       : t->key & 1 ? GL_SRGB8_ALPHA8
                                                    : GL_RGBA8,
                             .width = (int)texture_level_side(t->width, top),
                             .height = (int)texture_level_side(t->height, top),
                             .levels = t->needs_levels ? (int)(texture_last_level(t) - top) + 1 : 1,
                         },
                         err))
        return false;
    count_in(t, texture, texture_bytes_from(t, top, is_packed));
    return true;
}

static void drop(struct stored_texture *t, struct gl_texture *texture)
{
    t->store->pool->resident_bytes -= texture->size_bytes;
    t->store->full_bytes -= texture->size_bytes;
    gl_texture_finish(texture);
}

static bool has_level(const struct stored_texture *t, const struct texture_levels_held *held,
                      uint32_t level)
{
    return held->texture.name && (t->needs_levels ? level >= held->top : level == held->top);
}

/* The one of the two textures on the GPU that has the level in this form, or NULL. */
static const struct texture_levels_held *source_of(const struct stored_texture *t, uint32_t level,
                                                   bool is_packed)
{
    return has_level(t, &t->full, level) && t->full.is_packed == is_packed ? &t->full
           : has_level(t, &t->floor, level) && !is_packed                  ? &t->floor
                                                                           : NULL;
}

bool texture_has_level(const struct stored_texture *t, uint32_t level, bool is_packed)
{
    return source_of(t, level, is_packed) != NULL;
}

bool texture_needs_packing(const struct stored_texture *t, uint32_t top,
                           struct texture_packing *what)
{
    const struct scene *scene = t->store->scene;
    const struct scene_image *image = &scene->images[t->key / 2];
    uint32_t end = !t->needs_levels                            ? top + 1
                   : t->full.texture.name && t->full.is_packed ? t->full.top
                                                               : t->level_count;
    *what =
        (struct texture_packing){.image = scene->pixels + image->offset_bytes,
                                 .levels = scene->pixels + image->levels_offset_bytes[t->key & 1],
                                 .width_px = t->width,
                                 .height_px = t->height,
                                 .top = (uint8_t)top,
                                 .end = (uint8_t)end,
                                 .has_alpha = t->has_alpha};
    return top < end;
}

struct rows {                  /* of the level that comes next */
    uint32_t count, height_px; /* height_px: of a row */
    uint64_t bytes;            /* of a row */
};

static struct rows rows_of(const struct texture_incoming *in)
{
    uint32_t width = texture_level_side(in->of->width, in->level);
    uint32_t height = texture_level_side(in->of->height, in->level);
    if (!in->is_packed)
        return (struct rows){height, 1, 4ull * width};
    return (struct rows){texture_blocks_across(height), TEXTURE_BLOCK_SIDE,
                         (uint64_t)texture_block_bytes(in->of->has_alpha) *
                             texture_blocks_across(width)};
}

/* Copies rows of a level from the GPU if they are there, and else from the scene's file. */
static void write_rows(const struct texture_incoming *in, uint32_t count)
{
    const struct stored_texture *t = in->of;
    const struct texture_levels_held *from = source_of(t, in->level, in->is_packed);
    const struct rows rows = rows_of(in);
    GLsizei width = (GLsizei)texture_level_side(t->width, in->level);
    GLint to = (GLint)(in->level - in->top), y = (GLint)(in->row * rows.height_px);
    GLsizei height = (GLsizei)texture_level_side(t->height, in->level) - y;
    if (in->row + count < rows.count)
        height = (GLsizei)(count * rows.height_px);
    if (from)
        glCopyImageSubData(from->texture.name, GL_TEXTURE_2D, (GLint)(in->level - from->top), 0, y,
                           0, in->texture.name, GL_TEXTURE_2D, to, 0, y, 0, width, height, 1);
    else if (in->is_packed)
        glCompressedTextureSubImage2D(in->texture.name, to, 0, y, width, height, blocks_format(t),
                                      (GLsizei)(count * rows.bytes),
                                      in->packed.blocks + levels_bytes(t, in->top, true) -
                                          levels_bytes(t, in->level, true) + in->row * rows.bytes);
    else
        glTextureSubImage2D(in->texture.name, to, 0, y, width, height, GL_RGBA, GL_UNSIGNED_BYTE,
                            texture_level_pixels(t, in->level) + in->row * rows.bytes);
}

bool texture_is_complete(const struct texture_incoming *in)
{
    return in->level > (in->of->needs_levels ? texture_last_level(in->of) : in->top);
}

void texture_advance(struct texture_incoming *in, struct texture_spending *spending)
{
    uint64_t chunk = in->of->store->pool->pace.chunk_bytes;
    while (!texture_is_complete(in) && !texture_spending_is_over(spending)) {
        const struct rows rows = rows_of(in);
        uint64_t count = chunk / rows.bytes ? chunk / rows.bytes : 1;
        count = count < rows.count - in->row ? count : rows.count - in->row;
        write_rows(in, (uint32_t)count);
        spending->written_bytes += count * rows.bytes;
        in->row += (uint32_t)count;
        if (in->row == rows.count) {
            in->row = 0;
            in->level++;
        }
    }
}

static bool begin(struct stored_texture *t, uint32_t top, bool is_packed,
                  struct texture_incoming *in, struct error *err)
{
    *in = (struct texture_incoming){
        .of = t, .top = (uint8_t)top, .level = top, .is_packed = is_packed};
    if (make_texture(t, top, is_packed, &in->texture, err))
        return true;
    *in = (struct texture_incoming){0};
    return false;
}

bool texture_begin(struct stored_texture *t, uint32_t top, const struct texture_packed *packed,
                   struct texture_incoming *in, struct error *err)
{
    struct texture_packing what;
    struct texture_packed blocks = packed ? *packed : (struct texture_packed){0};
    bool is_good = true;
    if (t->packs && texture_needs_packing(t, top, &what) && !blocks.blocks)
        is_good = error_set(err, ERROR_NO_MEMORY, "compressing image %u", t->key / 2);
    if (!is_good || !begin(t, top, t->packs, in, err)) {
        free(blocks.blocks);
        return false;
    }
    if (t->packs && !blocks.blocks)
        blocks.mean_square = t->full.mean_square;
    in->packed = blocks;
    return true;
}

void texture_install(struct texture_incoming *in)
{
    struct stored_texture *t = in->of;
    drop(t, &t->full.texture);
    t->full = (struct texture_levels_held){.texture = in->texture,
                                           .top = in->top,
                                           .base = in->top,
                                           .is_packed = in->is_packed,
                                           .mean_square = in->packed.mean_square};
    free(in->packed.blocks);
    *in = (struct texture_incoming){0};
}

void texture_abandon(struct texture_incoming *in)
{
    if (in->of)
        drop(in->of, &in->texture);
    free(in->packed.blocks);
    *in = (struct texture_incoming){0};
}

bool texture_replace(struct stored_texture *t, uint32_t top, struct texture_spending *spending,
                     struct error *err)
{
    struct texture_pool *pool = t->store->pool;
    struct texture_incoming in;
    struct texture_spending all = {.limit_bytes = UINT64_MAX, .limit_ms = INFINITY};
    struct texture_packing what;
    struct texture_packed packed = {0};
    if (pool->incoming.of == t) /* it was to take over what goes */
        texture_abandon(&pool->incoming);
    if (t->packs && texture_needs_packing(t, top, &what))
        packed = texture_packer_take(pool->packer, &what);
    if (!texture_begin(t, top, &packed, &in, err))
        return false;
    texture_advance(&in, &all);
    texture_install(&in);
    spending->written_bytes += all.written_bytes;
    return true;
}

void texture_reserve(struct stored_texture *t)
{
    count_in(t, &t->full.texture, texture_bytes_from(t, 0, false));
}

bool texture_bring_reserved(struct stored_texture *t, struct texture_spending *spending,
                            struct error *err)
{
    drop(t, &t->full.texture);
    t->packs = false; /* of a request that sampled nothing of it here */
    return texture_replace(t, 0, spending, err);
}

bool texture_make_floor(struct stored_texture *t, bool may_read, struct error *err)
{
    struct texture_pool *pool = t->store->pool;
    uint32_t top = texture_first_level(t, 0);
    uint64_t bytes = texture_bytes_from(t, top, false);
    if (t->floor.texture.name ||
        pool->floor_bytes + bytes > pool->budget_bytes / TEXTURE_FLOOR_SHARE ||
        (!may_read && !source_of(t, top, false)))
        return true;
    struct texture_incoming in;
    struct texture_spending all = {.limit_bytes = UINT64_MAX, .limit_ms = INFINITY};
    if (!begin(t, top, false, &in, err))
        return false;
    texture_advance(&in, &all);
    t->floor = (struct texture_levels_held){
        .texture = in.texture, .top = (uint8_t)top, .base = (uint8_t)top};
    t->store->full_bytes -= bytes; /* they count apart */
    t->store->floor_bytes += bytes;
    pool->floor_bytes += bytes;
    return true;
}

bool texture_let_go(struct stored_texture *t, struct error *err)
{
    if (t->store->pool->incoming.of == t) /* it was to take over what goes */
        texture_abandon(&t->store->pool->incoming);
    bool is_good = texture_make_floor(t, false, err);
    drop(t, &t->full.texture);
    t->full = (struct texture_levels_held){.top = 0};
    return is_good;
}

void texture_drop_all(struct stored_texture *t)
{
    struct texture_pool *pool = t->store->pool;
    drop(t, &t->full.texture);
    pool->resident_bytes -= t->floor.texture.size_bytes;
    pool->floor_bytes -= t->floor.texture.size_bytes;
    gl_texture_finish(&t->floor.texture);
}

/* SPDX-License-Identifier: MIT */
/* Residency of images: what is granted, what goes, what comes. A texture holds the levels from its
 * `top` to the last; finer or coarser ones take a texture of another size, which takes over what
 * both have. */
#include "renderer/scene/texture_store.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/texture_levels.h"
#include "renderer/scene/texture_need.h"
#include "renderer/scene/texture_reader.h"

enum {
    FIRST_SIDE_PX = 16,    /* the levels that a coarse frame begins with, 1.3 kB */
    STEP_LEVELS = 2,       /* a sixteenth of the bytes first, of all textures */
    CHUNK_BYTES = 1 << 20, /* of one call */
    READ_AHEAD = 8,        /* textures whose pixels are read before it is their turn */
    LIMIT_DEFAULT = 16 << 20,
};

struct stored_texture {
    bool is_used, needs_levels; /* by some sampler; else one level is resident */
    uint32_t width, height;     /* of level 0 */
    uint8_t level_count;        /* of the image */
    struct gl_texture texture;  /* unnamed: none */
    uint8_t top;                /* its finest level */
    uint8_t base;               /* the one sampled as the finest: its GL level plus top */
    uint8_t wanted, granted;    /* by the frame, or TEXTURE_UNNEEDED */
    uint64_t last_use;
};

struct incoming { /* a texture in the making, to take the place of one that is drawn with */
    struct gl_texture texture;
    uint32_t key, row, level; /* the next to be written */
    uint8_t top;
};

struct texture_store {
    const struct scene *scene;
    struct stored_texture *textures; /* by texture_key */
    uint32_t count;
    struct texture_reader *reader; /* NULL: all is resident */
    struct incoming incoming;
    uint32_t *keys; /* as many as textures: scratch */
    uint64_t budget_bytes, resident_bytes, clock;
};

/* ---- sizes ---- */

static uint64_t bytes_from(const struct stored_texture *t, uint32_t top)
{
    uint64_t from = texture_levels_bytes(t->width, t->height, top);
    return t->needs_levels ? from : from - texture_levels_bytes(t->width, t->height, top + 1);
}

static uint64_t level_bytes(const struct stored_texture *t, uint32_t level)
{
    return 4ull * texture_level_side(t->width, level) * texture_level_side(t->height, level);
}

static uint32_t last_level(const struct stored_texture *t)
{
    return t->level_count - 1u;
}

static uint32_t first_level(const struct stored_texture *t, uint32_t finest)
{
    uint32_t level = finest;
    while (level < last_level(t) && texture_level_side(t->width, level) > FIRST_SIDE_PX &&
           texture_level_side(t->height, level) > FIRST_SIDE_PX)
        level++;
    return level;
}

static const uint8_t *level_pixels(const struct texture_store *store, uint32_t key, uint32_t level)
{
    const struct stored_texture *t = &store->textures[key];
    const struct scene_image *image = &store->scene->images[key / 2];
    if (level == 0)
        return store->scene->pixels + image->offset_bytes;
    return store->scene->pixels + image->levels_offset_bytes[key & 1] +
           texture_levels_bytes(t->width, t->height, 1) -
           texture_levels_bytes(t->width, t->height, level);
}

/* ---- textures ---- */

static bool make_texture(struct texture_store *store, uint32_t key, uint32_t top,
                         struct gl_texture *texture, struct error *err)
{
    const struct stored_texture *t = &store->textures[key];
    if (!gl_texture_init(texture,
                         &(struct gl_texture_desc){
                             .label = "scene.image",
                             .format = key & 1 ? GL_SRGB8_ALPHA8 : GL_RGBA8,
                             .width = (int)texture_level_side(t->width, top),
                             .height = (int)texture_level_side(t->height, top),
                             .levels = t->needs_levels ? (int)(last_level(t) - top) + 1 : 1,
                         },
                         err))
        return false;
    texture->size_bytes = bytes_from(t, top);
    store->resident_bytes += texture->size_bytes;
    return true;
}

static void drop(struct texture_store *store, struct gl_texture *texture)
{
    store->resident_bytes -= texture->size_bytes;
    gl_texture_finish(texture);
}

static void abandon(struct texture_store *store)
{
    drop(store, &store->incoming.texture);
    store->incoming = (struct incoming){0};
}

/* Takes the place of what was there. */
static void install(struct texture_store *store, struct incoming *incoming)
{
    struct stored_texture *t = &store->textures[incoming->key];
    drop(store, &t->texture);
    t->texture = incoming->texture;
    t->top = t->base = incoming->top;
    *incoming = (struct incoming){0};
}

/* Rows of a level: from the texture that is drawn with where that has it, else from the scene. */
static void write_rows(const struct texture_store *store, const struct incoming *in, uint32_t rows)
{
    const struct stored_texture *t = &store->textures[in->key];
    uint32_t width = texture_level_side(t->width, in->level);
    GLint to = (GLint)(in->level - in->top), y = (GLint)in->row;
    if (t->needs_levels && t->texture.name && in->level >= t->top)
        glCopyImageSubData(t->texture.name, GL_TEXTURE_2D, (GLint)(in->level - t->top), 0, y, 0,
                           in->texture.name, GL_TEXTURE_2D, to, 0, y, 0, (GLsizei)width,
                           (GLsizei)rows, 1);
    else
        glTextureSubImage2D(in->texture.name, to, 0, y, (GLsizei)width, (GLsizei)rows, GL_RGBA,
                            GL_UNSIGNED_BYTE,
                            level_pixels(store, in->key, in->level) + 4ull * width * in->row);
}

static bool is_complete(const struct texture_store *store, const struct incoming *in)
{
    const struct stored_texture *t = &store->textures[in->key];
    return in->level > (t->needs_levels ? last_level(t) : in->top);
}

/* Up to *left_bytes, of which it takes what it wrote; a chunk more at most. */
static void advance(const struct texture_store *store, struct incoming *in, uint64_t *left_bytes)
{
    const struct stored_texture *t = &store->textures[in->key];
    while (*left_bytes && !is_complete(store, in)) {
        uint64_t row_bytes = 4ull * texture_level_side(t->width, in->level);
        uint32_t height = texture_level_side(t->height, in->level);
        uint64_t rows = CHUNK_BYTES / row_bytes ? CHUNK_BYTES / row_bytes : 1;
        rows = rows < height - in->row ? rows : height - in->row;
        write_rows(store, in, (uint32_t)rows);
        *left_bytes -= rows * row_bytes < *left_bytes ? rows * row_bytes : *left_bytes;
        in->row += (uint32_t)rows;
        if (in->row == height) {
            in->row = 0;
            in->level++;
        }
    }
}

static bool replace(struct texture_store *store, uint32_t key, uint32_t top, uint64_t *written,
                    struct error *err)
{
    struct incoming in = {.key = key, .top = (uint8_t)top, .level = top};
    uint64_t left = UINT64_MAX;
    if (!make_texture(store, key, top, &in.texture, err))
        return false;
    advance(store, &in, &left);
    install(store, &in);
    *written += UINT64_MAX - left;
    return true;
}

/* ---- what is granted ---- */

static uint64_t granted_bytes(const struct texture_store *store, uint32_t bias)
{
    uint64_t bytes = 0;
    for (uint32_t key = 0; key < store->count; key++) {
        const struct stored_texture *t = &store->textures[key];
        uint32_t level = t->wanted + bias;
        if (t->wanted != TEXTURE_UNNEEDED)
            bytes += bytes_from(t, level < last_level(t) ? level : last_level(t));
    }
    return bytes;
}

/* Level by level, in the order of the images, while there is room. */
static void give_back(struct texture_store *store, uint32_t bias, uint64_t bytes)
{
    for (; bias > 0; bias--)
        for (uint32_t key = 0; key < store->count; key++) {
            struct stored_texture *t = &store->textures[key];
            if (t->wanted == TEXTURE_UNNEEDED || t->granted < t->wanted + bias)
                continue;
            uint64_t more = bytes_from(t, t->granted - 1u) - bytes_from(t, t->granted);
            if (bytes + more > store->budget_bytes)
                continue;
            bytes += more;
            t->granted--;
        }
}

static bool grant(struct texture_store *store, const struct texture_wish *wish,
                  struct report_textures *report, struct error *err)
{
    store->clock++;
    for (uint32_t key = 0; key < store->count; key++) {
        struct stored_texture *t = &store->textures[key];
        t->wanted = t->is_used ? wish->levels[key] : TEXTURE_UNNEEDED;
        if (t->wanted != TEXTURE_UNNEEDED)
            t->last_use = store->clock;
    }
    uint32_t bias = 0;
    uint64_t bytes = report->wanted_bytes = granted_bytes(store, 0);
    while (bytes > store->budget_bytes) {
        uint64_t before = bytes;
        bytes = granted_bytes(store, ++bias);
        if (bytes == before && bias > TEXTURE_LEVELS_MAX)
            return error_set(err, ERROR_OVER_BUDGET,
                             "the coarsest levels of the textures in view take %llu bytes, the "
                             "budget of textures is %llu",
                             (unsigned long long)bytes, (unsigned long long)store->budget_bytes);
    }
    for (uint32_t key = 0; key < store->count; key++) {
        struct stored_texture *t = &store->textures[key];
        uint32_t level = t->wanted + bias, last = last_level(t);
        t->granted = (uint8_t)(t->wanted == TEXTURE_UNNEEDED ? TEXTURE_UNNEEDED
                               : level < last                ? level
                                                             : last);
    }
    give_back(store, bias, bytes);
    for (uint32_t key = 0; key < store->count; key++) {
        const struct stored_texture *t = &store->textures[key];
        uint32_t withheld = t->wanted == TEXTURE_UNNEEDED ? 0u : (uint32_t)t->granted - t->wanted;
        report->level_bias = withheld > report->level_bias ? withheld : report->level_bias;
    }
    return true;
}

/* ---- what goes ---- */

static bool is_missing(const struct stored_texture *t)
{
    return t->granted != TEXTURE_UNNEEDED && (!t->texture.name || t->top > t->granted);
}

/* With all that is granted, and what stays beside it. */
static uint64_t bytes_to_be(const struct texture_store *store)
{
    uint64_t bytes = 0;
    for (uint32_t key = 0; key < store->count; key++) {
        const struct stored_texture *t = &store->textures[key];
        bytes += is_missing(t) ? bytes_from(t, t->granted) : t->texture.size_bytes;
    }
    return bytes;
}

/* Unneeded and used least recently; store->count: none. */
static uint32_t find_victim(const struct texture_store *store)
{
    uint32_t found = store->count;
    for (uint32_t key = 0; key < store->count; key++) {
        const struct stored_texture *t = &store->textures[key];
        if (t->granted == TEXTURE_UNNEEDED && t->texture.name &&
            (found == store->count || t->last_use < store->textures[found].last_use))
            found = key;
    }
    return found;
}

/* Before anything comes: textures that nothing needs, then levels that nothing needs, until `limit`
 * bytes were copied. */
static bool make_room(struct texture_store *store, uint64_t limit, uint64_t *written,
                      struct error *err)
{
    uint64_t bytes = bytes_to_be(store);
    for (uint32_t key; bytes > store->budget_bytes && (key = find_victim(store)) < store->count;) {
        bytes -= store->textures[key].texture.size_bytes;
        drop(store, &store->textures[key].texture);
    }
    for (uint32_t key = 0; key < store->count && bytes > store->budget_bytes && *written < limit;
         key++) {
        struct stored_texture *t = &store->textures[key];
        if (t->granted == TEXTURE_UNNEEDED || !t->texture.name || t->top >= t->granted)
            continue;
        bytes -= t->texture.size_bytes - bytes_from(t, t->granted);
        if (!replace(store, key, t->granted, written, err))
            return false;
    }
    return true;
}

/* ---- what comes ---- */

static void read_ahead(struct texture_store *store, uint32_t key)
{
    for (int ahead = 0; key < store->count && ahead < READ_AHEAD; key++) {
        const struct stored_texture *t = &store->textures[key];
        if (!is_missing(t))
            continue;
        texture_reader_ask(store->reader, level_pixels(store, key, t->granted),
                           level_bytes(t, t->granted));
        ahead++;
    }
}

static bool bring_all(struct texture_store *store, uint64_t *written, struct error *err)
{
    for (uint32_t key = 0; key < store->count; key++) {
        if (!is_missing(&store->textures[key]))
            continue;
        read_ahead(store, key + 1);
        if (!replace(store, key, store->textures[key].granted, written, err))
            return false;
    }
    return true;
}

/* The level that a coarse frame goes to next. */
static uint8_t next_top(const struct stored_texture *t)
{
    return (uint8_t)(t->top > t->granted + STEP_LEVELS + 1 ? t->granted + STEP_LEVELS : t->granted);
}

/* Whether its new levels are in memory; else they are asked for. */
static bool are_read(struct texture_store *store, uint32_t key, uint32_t top)
{
    const struct stored_texture *t = &store->textures[key];
    bool all = true;
    for (uint32_t level = top; level < t->top; level++)
        if (t->needs_levels || level == top)
            all &= texture_reader_ask(store->reader, level_pixels(store, key, level),
                                      level_bytes(t, level));
    return all;
}

/* Those that lack levels, the coarsest first. */
static uint32_t list_missing(const struct texture_store *store, uint32_t *keys)
{
    uint32_t count = 0;
    for (int lacks = TEXTURE_LEVELS_MAX; lacks > 0; lacks--)
        for (uint32_t key = 0; key < store->count; key++) {
            const struct stored_texture *t = &store->textures[key];
            if (is_missing(t) && t->top - t->granted == lacks)
                keys[count++] = key;
        }
    return count;
}

static bool has_room(const struct texture_store *store, uint32_t key, uint32_t top)
{
    const struct stored_texture *t = &store->textures[key];
    return store->resident_bytes - t->texture.size_bytes + bytes_from(t, top) <=
           store->budget_bytes;
}

static void advance_incoming(struct texture_store *store, uint64_t *left)
{
    advance(store, &store->incoming, left);
    if (is_complete(store, &store->incoming))
        install(store, &store->incoming);
}

/* One step for each that is listed and read, while the limit allows. */
static bool bring_listed(struct texture_store *store, const uint32_t *keys, uint32_t count,
                         uint64_t *left, struct error *err)
{
    int unread = 0;
    for (uint32_t i = 0; i < count && *left && unread < READ_AHEAD; i++) {
        uint8_t top = next_top(&store->textures[keys[i]]);
        if (!are_read(store, keys[i], top)) {
            unread++;
            continue;
        }
        if (!has_room(store, keys[i], top))
            continue;
        store->incoming = (struct incoming){.key = keys[i], .top = top, .level = top};
        if (!make_texture(store, keys[i], top, &store->incoming.texture, err))
            return false;
        advance_incoming(store, left);
    }
    return true;
}

/* Something to draw with for each, then finer levels while the limit and the disk allow. */
static bool bring_some(struct texture_store *store, uint64_t limit, uint64_t *written,
                       struct error *err)
{
    for (uint32_t key = 0; key < store->count; key++) {
        const struct stored_texture *t = &store->textures[key];
        if (is_missing(t) && !t->texture.name &&
            !replace(store, key, first_level(t, t->granted), written, err))
            return false;
    }
    uint64_t left = limit > *written ? limit - *written : 0, begun = left, before;
    if (left && store->incoming.texture.name)
        advance_incoming(store, &left);
    bool is_good = true;
    do {
        before = left;
        uint32_t count = list_missing(store, store->keys);
        is_good = bring_listed(store, store->keys, count, &left, err);
    } while (is_good && left && left < before);
    *written += begun - left;
    return is_good;
}

/* ---- the door ---- */

static void count_missing(const struct texture_store *store, struct report_textures *report)
{
    for (uint32_t key = 0; key < store->count; key++) {
        const struct stored_texture *t = &store->textures[key];
        if (t->wanted == TEXTURE_UNNEEDED)
            continue;
        report->coarse_count += t->top > t->wanted;
        if (is_missing(t))
            report->pending_bytes += bytes_from(t, t->granted) - t->texture.size_bytes;
    }
    report->budget_bytes = store->budget_bytes;
    report->resident_bytes = store->resident_bytes;
}

bool texture_store_prepare(struct texture_store *store, const struct texture_wish *wish,
                           struct report_textures *report, struct error *err)
{
    *report = (struct report_textures){0};
    if (!grant(store, wish, report, err))
        return false;
    struct incoming *in = &store->incoming;
    if (in->texture.name && (!wish->may_be_coarse || !is_missing(&store->textures[in->key]) ||
                             in->top < store->textures[in->key].granted))
        abandon(store);
    uint64_t limit = !wish->may_be_coarse ? UINT64_MAX
                     : wish->limit_bytes  ? wish->limit_bytes
                                          : LIMIT_DEFAULT;
    bool is_done = make_room(store, limit, &report->written_bytes, err) &&
                   (wish->may_be_coarse ? bring_some(store, limit, &report->written_bytes, err)
                                        : bring_all(store, &report->written_bytes, err));
    count_missing(store, report);
    return is_done;
}

void texture_store_report(const struct texture_store *store, struct report_textures *report)
{
    *report = (struct report_textures){.budget_bytes = store->budget_bytes,
                                       .resident_bytes = store->resident_bytes,
                                       .wanted_bytes = store->resident_bytes};
}

const struct gl_texture *texture_store_use(struct texture_store *store, uint32_t key,
                                           uint8_t finest)
{
    struct stored_texture *t = &store->textures[key];
    if (!t->texture.name)
        return NULL;
    uint8_t base = finest != TEXTURE_UNNEEDED && finest > t->top ? finest : t->top;
    if (base != t->base && t->needs_levels) {
        glTextureParameteri(t->texture.name, GL_TEXTURE_BASE_LEVEL, base - t->top);
        t->base = base;
    }
    return &t->texture;
}

bool texture_store_is_on_demand(const struct texture_store *store)
{
    return store->reader != NULL;
}

uint64_t texture_store_resident_bytes(const struct texture_store *store)
{
    return store->resident_bytes;
}

/* ---- life ---- */

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

static bool check_sizes(const struct texture_store *store, uint64_t *bytes, struct error *err)
{
    GLint most;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    for (uint32_t key = 0; key < store->count; key++) {
        struct stored_texture *t = &store->textures[key];
        t->width = store->scene->images[key / 2].width_px;
        t->height = store->scene->images[key / 2].height_px;
        t->level_count = (uint8_t)texture_level_count(t->width, t->height);
        t->granted = t->wanted = TEXTURE_UNNEEDED;
        if (!t->is_used)
            continue;
        if (t->width > (uint32_t)most || t->height > (uint32_t)most)
            return error_set(err, ERROR_UNSUPPORTED, "image %u is %ux%u, the device takes %d",
                             key / 2, t->width, t->height, most);
        *bytes += bytes_from(t, 0);
    }
    return true;
}

static bool fill(struct texture_store *store, struct error *err)
{
    uint64_t written = 0;
    for (uint32_t key = 0; key < store->count; key++)
        if (store->textures[key].is_used && !replace(store, key, 0, &written, err))
            return false;
    return true;
}

struct texture_store *texture_store_create(const struct scene *scene, uint64_t budget_bytes,
                                           struct error *err)
{
    struct texture_store *store = calloc(1, sizeof *store);
    if (store)
        store->textures = calloc(2 * (size_t)scene->image_count + 1, sizeof *store->textures);
    if (store)
        store->keys = calloc(2 * (size_t)scene->image_count + 1, sizeof *store->keys);
    if (!store || !store->textures || !store->keys) {
        texture_store_destroy(store);
        error_set(err, ERROR_NO_MEMORY, "%u images", scene->image_count);
        return NULL;
    }
    store->scene = scene;
    store->count = 2 * scene->image_count;
    store->budget_bytes = budget_bytes;
    note_uses(store);
    uint64_t bytes = 0;
    bool is_good = check_sizes(store, &bytes, err);
    if (is_good && bytes > budget_bytes)
        is_good = (store->reader = texture_reader_create(err)) != NULL;
    else if (is_good)
        is_good = fill(store, err);
    if (is_good)
        return store;
    texture_store_destroy(store);
    return NULL;
}

void texture_store_destroy(struct texture_store *store)
{
    if (!store)
        return;
    texture_reader_destroy(store->reader);
    gl_texture_finish(&store->incoming.texture);
    for (uint32_t key = 0; key < store->count; key++)
        gl_texture_finish(&store->textures[key].texture);
    free(store->textures);
    free(store->keys);
    free(store);
}

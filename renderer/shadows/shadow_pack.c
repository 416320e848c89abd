/* SPDX-License-Identifier: MIT */
/* Faces from textures into buffers. */
#include "renderer/shadows/shadow_pack.h"

#include <epoxy/gl.h>
#include <string.h>

enum {
    COPY_BYTES = 1 << 30, /* in one call: fits GLsizei */
    ASIDE_BYTES = 64 << 20,
};

struct band { /* rows of consecutive layers; more than one layer: all rows of each */
    uint32_t layer, layers;
    uint32_t row, rows;
    uint64_t to_bytes; /* in the pool */
};

/* Whether the build's faces, in the target and in the pool, follow so many of another's. */
static bool follows(const struct shadow_pack_desc *desc, const struct shadow_build *build,
                    const struct shadow_build *other, uint32_t layers)
{
    uint64_t side = (uint64_t)build->map->resolution;
    return build->target_layer == other->target_layer + layers &&
           desc->range(build->map)->first == desc->range(other->map)->first + layers * side * side;
}

/* zink (Mesa 25.0.7, zink_buffer_map) maps a buffer that a batch uses which is not flushed, or that
 * it takes for one, by a new buffer without its contents, and then copies all of that: what is
 * packed into a part spoils the rest. */
static bool spoils_buffers(const struct gl_limits *limits)
{
    return strstr(limits->renderer, "zink") != NULL;
}

/* Into the buffer that is bound for that. */
static void pack(const struct shadow_pack_desc *desc, const struct band *band, uint64_t bytes,
                 uint64_t to_bytes)
{
    glGetTextureSubImage(desc->from->name, 0, 0, (GLint)band->row, (GLint)band->layer,
                         desc->from->width, (GLsizei)band->rows, (GLsizei)band->layers,
                         desc->format, GL_FLOAT, (GLsizei)bytes, (void *)(uintptr_t)to_bytes);
}

/* To a buffer of its own, all of which is packed, and from there to its place. */
static bool pack_aside(const struct shadow_pack_desc *desc, const struct band *band, uint64_t bytes,
                       struct gl_buffer *to, struct error *err)
{
    const struct gl_buffer_desc aside_desc = {.label = "shadow.pack.aside", .size_bytes = bytes};
    struct gl_buffer aside = {0};
    if (!gl_buffer_init(&aside, &aside_desc, err))
        return false;
    glBindBuffer(GL_PIXEL_PACK_BUFFER, aside.name);
    pack(desc, band, bytes, 0);
    gl_buffer_copy(&aside, 0, to, band->to_bytes, bytes);
    gl_buffer_finish(&aside);
    return true;
}

static bool pack_band(struct shadow_store *store, const struct shadow_pack_desc *desc,
                      const struct band *band, struct error *err)
{
    struct gl_buffer *pool = &store->pools[desc->pool].streams[0];
    uint64_t side = (uint64_t)desc->from->width;
    uint64_t bytes = desc->texel_bytes * side * band->rows * band->layers;
    if (spoils_buffers(store->limits))
        return pack_aside(desc, band, bytes, pool, err);
    pack(desc, band, bytes, band->to_bytes);
    return true;
}

/* As many faces at a time as one call takes, or rows of one. */
static bool pack_layers(struct shadow_store *store, const struct shadow_pack_desc *desc,
                        const struct shadow_build *first, uint32_t layers, struct error *err)
{
    uint64_t side = (uint64_t)first->map->resolution, row_bytes = desc->texel_bytes * side;
    uint64_t most = spoils_buffers(store->limits) ? ASIDE_BYTES : COPY_BYTES;
    uint64_t rows = most / row_bytes, faces = most / (row_bytes * side);
    bool ok = true;
    if (rows > side)
        rows = side;
    for (uint32_t layer = 0, count; ok && layer < layers; layer += count) {
        count = !faces ? 1 : layers - layer < faces ? layers - layer : (uint32_t)faces;
        for (uint64_t row = 0; ok && row < side; row += rows) {
            const struct band band = {.layer = first->target_layer + layer,
                                      .layers = count,
                                      .row = (uint32_t)row,
                                      .rows = (uint32_t)(side - row < rows ? side - row : rows),
                                      .to_bytes =
                                          desc->texel_bytes * desc->range(first->map)->first +
                                          row_bytes * (layer * side + row)};
            ok = pack_band(store, desc, &band, err);
        }
    }
    return ok;
}

bool shadow_pack(struct shadow_store *store, const struct shadow_pack_desc *desc, struct error *err)
{
    bool ok = true;
    glBindBuffer(GL_PIXEL_PACK_BUFFER, store->pools[desc->pool].streams[0].name);
    for (size_t i = 0; ok && i < desc->build_count;) {
        const struct shadow_build *first = desc->builds[i];
        uint32_t layers = 0;
        do
            layers += desc->builds[i++]->map->frame.face_count;
        while (i < desc->build_count && follows(desc, desc->builds[i], first, layers));
        ok = pack_layers(store, desc, first, layers, err);
    }
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    return ok;
}

/* SPDX-License-Identifier: MIT */
/* Opaque depth: the plain shadow map, and what hides events from the lists. */
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/technique.h"

enum {
    COPY_BYTES = 1 << 30, /* in one call: fits GLsizei, and a face of 16,384 texels */
    ASIDE_BYTES = 64 << 20,
};

/* Whether the build's faces, in the target and in the pool, follow so many of another's. */
static bool follows(const struct shadow_build *build, const struct shadow_build *other,
                    uint32_t layers)
{
    uint64_t side = (uint64_t)build->map->resolution;
    return build->target_layer == other->target_layer + layers &&
           build->map->depths.first == other->map->depths.first + layers * side * side;
}

/* zink (Mesa 25.0.7, zink_buffer_map) maps a buffer that a batch uses which is not flushed, or that
 * it takes for one, by a new buffer without its contents, and then copies all of that: what is
 * packed into a part spoils the rest. */
static bool spoils_buffers(const struct gl_limits *limits)
{
    return strstr(limits->renderer, "zink") != NULL;
}

/* Into the buffer that is bound for that. */
static void pack(const struct shadow_store *store, uint32_t layer, uint32_t layers, uint64_t bytes,
                 uint64_t to_bytes)
{
    int side = store->target.width;
    glGetTextureSubImage(store->target.name, 0, 0, 0, (GLint)layer, side, side, (GLsizei)layers,
                         GL_DEPTH_COMPONENT, GL_FLOAT, (GLsizei)bytes, (void *)(uintptr_t)to_bytes);
}

/* To a buffer of its own, all of which is packed, and from there to its place. */
static bool pack_aside(const struct shadow_store *store, uint32_t layer, uint32_t layers,
                       uint64_t bytes, struct gl_buffer *to, uint64_t to_bytes, struct error *err)
{
    const struct gl_buffer_desc desc = {.label = "shadow.depth.aside", .size_bytes = bytes};
    struct gl_buffer aside = {0};
    if (!gl_buffer_init(&aside, &desc, err))
        return false;
    glBindBuffer(GL_PIXEL_PACK_BUFFER, aside.name);
    pack(store, layer, layers, bytes, 0);
    gl_buffer_copy(&aside, 0, to, to_bytes, bytes);
    gl_buffer_finish(&aside);
    return true;
}

static bool copy_layers(struct shadow_store *store, const struct shadow_build *first,
                        uint32_t layers, struct error *err)
{
    struct gl_buffer *pool = &store->pools[SHADOW_POOL_DEPTHS].streams[0];
    uint64_t side = (uint64_t)first->map->resolution, face_bytes = 4 * side * side;
    bool is_aside = spoils_buffers(store->limits), ok = true;
    uint64_t most = (is_aside ? ASIDE_BYTES : COPY_BYTES) / face_bytes;
    for (uint32_t layer = 0, count; ok && layer < layers; layer += count) {
        uint64_t offset = 4 * first->map->depths.first + layer * face_bytes;
        uint32_t from = first->target_layer + layer;
        count = !most ? 1 : layers - layer < most ? layers - layer : (uint32_t)most;
        if (is_aside)
            ok = pack_aside(store, from, count, count * face_bytes, pool, offset, err);
        else
            pack(store, from, count, count * face_bytes, offset);
    }
    return ok;
}

/* From the target into the pool, where a query finds it in a third of the time (llvmpipe). */
static bool copy_depths(struct shadow_store *store, const struct shadow_build *builds, size_t count,
                        struct error *err)
{
    bool ok = true;
    glMemoryBarrier(GL_PIXEL_BUFFER_BARRIER_BIT); /* counts of lists were there */
    glBindBuffer(GL_PIXEL_PACK_BUFFER, store->pools[SHADOW_POOL_DEPTHS].streams[0].name);
    for (size_t i = 0; ok && i < count;) {
        const struct shadow_build *first = &builds[i];
        uint32_t layers = 0;
        do
            layers += builds[i++].map->frame.face_count;
        while (i < count && follows(&builds[i], first, layers));
        ok = copy_layers(store, first, layers, err);
    }
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    return ok;
}

/* All builds, as the painter takes them. */
static bool paint(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                  const struct shadow_scene *scene, struct error *err)
{
    struct shadow_build **all = calloc(count, sizeof *all);
    const struct caster_paint_desc desc = {.pass = CASTER_DEPTH,
                                           .builds = all,
                                           .build_count = count,
                                           .scene = scene,
                                           .store = builder->store};
    for (size_t i = 0; all && i < count; i++)
        all[i] = &builds[i];
    bool ok = all ? caster_painter_paint(builder->painter, &desc, err)
                  : error_set(err, ERROR_NO_MEMORY, "%zu lights", count);
    free(all);
    return ok;
}

static bool take_depths(struct shadow_store *store, const struct shadow_build *builds, size_t count,
                        struct error *err)
{
    uint64_t layers = 0;
    for (size_t i = 0; i < count; i++) {
        struct shadow_map *map = builds[i].map;
        layers += map->frame.face_count;
        if (!shadow_store_take(store, SHADOW_POOL_DEPTHS, shadow_map_texels(map), &map->depths,
                               err))
            return false;
    }
    return shadow_store_reserve_target(store, builds[0].map->resolution, layers, err);
}

static void begin(const struct shadow_builder *builder, const char *because)
{
    const char *technique = shadow_technique_name((int)shadow_depth_pass.technique);
    gpu_scope_begin(builder->timeline, &(struct gpu_scope_desc){.pass = shadow_depth_pass.name,
                                                                .because = because,
                                                                .technique = technique,
                                                                .stage = REPORT_SHADOW});
}

bool shadow_depth_build(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                        const struct shadow_scene *scene, const char *because, struct error *err)
{
    if (!take_depths(builder->store, builds, count, err))
        return false;
    begin(builder, because);
    bool ok = paint(builder, builds, count, scene, err);
    gpu_scope_end(builder->timeline);
    return ok;
}

bool shadow_depth_keep(const struct shadow_builder *builder, const struct shadow_build *builds,
                       size_t count, const char *because, struct error *err)
{
    begin(builder, because);
    bool ok = copy_depths(builder->store, builds, count, err);
    gpu_scope_end(builder->timeline);
    return ok;
}

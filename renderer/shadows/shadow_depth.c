/* SPDX-License-Identifier: MIT */
/* Opaque depth: the plain shadow map, and what hides events from the lists. */
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/technique.h"

enum { COPY_BYTES = 1 << 30 }; /* in one call: fits GLsizei, and a face of 16,384 texels */

/* Whether the build's faces, in the target and in the pool, follow so many of another's. */
static bool follows(const struct shadow_build *build, const struct shadow_build *other,
                    uint32_t layers)
{
    uint64_t side = (uint64_t)build->map->resolution;
    return build->target_layer == other->target_layer + layers &&
           build->map->depths.first == other->map->depths.first + layers * side * side;
}

static void copy_layers(const struct shadow_store *store, const struct shadow_build *first,
                        uint32_t layers)
{
    int side = first->map->resolution;
    uint64_t face_bytes = 4ull * (uint64_t)side * (uint64_t)side;
    uint32_t most = (uint32_t)(COPY_BYTES / face_bytes), count;
    for (uint32_t layer = 0; layer < layers; layer += count) {
        void *offset = (void *)(uintptr_t)(4 * first->map->depths.first + layer * face_bytes);
        count = layers - layer < most ? layers - layer : most;
        glGetTextureSubImage(store->target.name, 0, 0, 0, (GLint)(first->target_layer + layer),
                             side, side, (GLsizei)count, GL_DEPTH_COMPONENT, GL_FLOAT,
                             (GLsizei)(count * face_bytes), offset);
    }
}

/* From the target into the pool, where a query finds it in a third of the time (llvmpipe). */
static void copy_depths(const struct shadow_store *store, const struct shadow_build *builds,
                        size_t count)
{
    glMemoryBarrier(GL_PIXEL_BUFFER_BARRIER_BIT); /* counts of lists were there */
    glBindBuffer(GL_PIXEL_PACK_BUFFER, store->pools[SHADOW_POOL_DEPTHS].streams[0].name);
    for (size_t i = 0; i < count;) {
        const struct shadow_build *first = &builds[i];
        uint32_t layers = 0;
        do
            layers += builds[i++].map->frame.face_count;
        while (i < count && follows(&builds[i], first, layers));
        copy_layers(store, first, layers);
    }
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
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

void shadow_depth_keep(const struct shadow_builder *builder, const struct shadow_build *builds,
                       size_t count, const char *because)
{
    begin(builder, because);
    copy_depths(builder->store, builds, count);
    gpu_scope_end(builder->timeline);
}

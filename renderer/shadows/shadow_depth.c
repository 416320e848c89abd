/* SPDX-License-Identifier: MIT */
/* Opaque depth: the plain shadow map, and what hides events from the lists. */
#include <epoxy/gl.h>

#include "renderer/shadows/shadow_deep.h"

/* From the target into the pool, where a query finds it in a third of the time (llvmpipe). */
static void copy_depths(const struct shadow_store *store, const struct shadow_build *build)
{
    const struct shadow_map *map = build->map;
    const struct shadow_pool *pool = &store->pools[SHADOW_POOL_DEPTHS];
    int side = map->resolution;
    uint64_t face_bytes = 4ull * (uint64_t)side * (uint64_t)side; /* at most 1 GiB: fits GLsizei */
    glBindBuffer(GL_PIXEL_PACK_BUFFER, pool->streams[0].name);
    for (uint32_t face = 0; face < map->frame.face_count; face++) {
        void *offset = (char *)NULL + 4 * map->depths.first + face * face_bytes;
        glGetTextureSubImage(store->target.name, 0, 0, 0, (GLint)(build->target_layer + face), side,
                             side, 1, GL_DEPTH_COMPONENT, GL_FLOAT, (GLsizei)face_bytes, offset);
    }
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
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

bool shadow_depth_build(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                        const struct shadow_scene *scene, const char *because, struct error *err)
{
    if (!take_depths(builder->store, builds, count, err))
        return false;
    bool ok = true;
    gpu_scope_begin(builder->timeline, &(struct gpu_scope_desc){.pass = "shadow.depth",
                                                                .because = because,
                                                                .technique = "map",
                                                                .stage = REPORT_SHADOW});
    for (size_t i = 0; ok && i < count; i++) {
        struct caster_paint_desc desc = {
            .pass = CASTER_DEPTH, .build = &builds[i], .scene = scene, .store = builder->store};
        ok = caster_painter_paint(builder->painter, &desc, err);
        if (ok)
            copy_depths(builder->store, &builds[i]);
    }
    gpu_scope_end(builder->timeline);
    return ok;
}

/* SPDX-License-Identifier: MIT */
/* Opaque depth: the plain shadow map, and what hides events from the lists. */
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_pack.h"
#include "renderer/shadows/technique.h"

/* All builds, as painter and pack take them; NULL without memory. */
static struct shadow_build **point_at(struct shadow_build *builds, size_t count, struct error *err)
{
    struct shadow_build **all = calloc(count, sizeof *all);
    for (size_t i = 0; all && i < count; i++)
        all[i] = &builds[i];
    if (!all)
        error_set(err, ERROR_NO_MEMORY, "%zu lights", count);
    return all;
}

static const struct shadow_range *depths_of(const struct shadow_map *map)
{
    return &map->depths;
}

static bool copy_depths(struct shadow_store *store, struct shadow_build *builds, size_t count,
                        struct error *err)
{
    struct shadow_build **all = point_at(builds, count, err);
    const struct shadow_pack_desc desc = {.from = &store->target,
                                          .format = GL_DEPTH_COMPONENT,
                                          .texel_bytes = 4,
                                          .pool = SHADOW_POOL_DEPTHS,
                                          .range = depths_of,
                                          .builds = all,
                                          .build_count = count};
    glMemoryBarrier(GL_PIXEL_BUFFER_BARRIER_BIT); /* counts of lists were there */
    bool ok = all && shadow_pack(store, &desc, err);
    free(all);
    return ok;
}

static bool paint(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                  const struct shadow_scene *scene, struct error *err)
{
    struct shadow_build **all = point_at(builds, count, err);
    const struct caster_paint_desc desc = {.pass = CASTER_DEPTH,
                                           .builds = all,
                                           .build_count = count,
                                           .scene = scene,
                                           .store = builder->store};
    bool ok = all && caster_painter_paint(builder->painter, &desc, err);
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

bool shadow_depth_keep(const struct shadow_builder *builder, struct shadow_build *builds,
                       size_t count, const char *because, struct error *err)
{
    begin(builder, because);
    bool ok = copy_depths(builder->store, builds, count, err);
    gpu_scope_end(builder->timeline);
    return ok;
}

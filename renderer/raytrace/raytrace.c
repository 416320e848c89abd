/* SPDX-License-Identifier: MIT */
/* The ray tracer's public functions: they build or reuse the scene, trace it, and report. */
#include "renderer/raytrace/raytrace.h"

#include <stdlib.h>

#include "renderer/base/wall_clock.h"
#include "renderer/raytrace/rt_job.h"

struct raytrace_cache {
    struct rt_scene scene; /* scene.scene NULL: empty */
    struct rt_scene spare; /* of who uses the cache while it is lent, where that is another */
    bool is_lent;          /* a picture that is paused needs the scene */
};

struct raytrace_cache *raytrace_cache_create(struct error *err)
{
    struct raytrace_cache *cache = calloc(1, sizeof *cache);
    if (!cache)
        error_set(err, ERROR_NO_MEMORY, "ray tracing cache");
    return cache;
}

void raytrace_cache_destroy(struct raytrace_cache *cache)
{
    if (!cache)
        return;
    raytrace_cache_clear(cache);
    free(cache);
}

void raytrace_cache_clear(struct raytrace_cache *cache)
{
    if (!cache->is_lent)
        rt_scene_finish(&cache->scene);
    rt_scene_finish(&cache->spare);
}

void raytrace_cache_lend(struct raytrace_cache *cache, bool is_lent)
{
    cache->is_lent = is_lent;
}

uint64_t raytrace_cache_size_bytes(const struct raytrace_cache *cache)
{
    return rt_scene_size_bytes(&cache->scene) + rt_scene_size_bytes(&cache->spare);
}

bool rt_job_take_scene(const struct raytrace_desc *desc, struct rt_scene *own,
                       struct rt_scene **scene, bool *is_reused, struct error *err)
{
    *scene = desc->cache ? &desc->cache->scene : own;
    *is_reused = rt_scene_rebind(*scene, desc->state, desc->view);
    if (!*is_reused && desc->cache && desc->cache->is_lent) {
        *scene = &desc->cache->spare;
        *is_reused = rt_scene_rebind(*scene, desc->state, desc->view);
    }
    if (*is_reused)
        return true;
    if (rt_scene_move(*scene, desc->state, desc->view))
        return true;
    rt_scene_finish(*scene);
    return rt_scene_init(*scene, desc->state, desc->view, err);
}

static bool run_form(struct rt_job *job, struct error *err)
{
    struct image *image = job->image;
    const struct view *view = job->desc->view;
    job->tile = view_tile_of(view);
    bool ok = image_init(image, job->tile.width_px, job->tile.height_px, 4, IMAGE_F32, err);
    job->unit_count = view->row_count_px ? view->row_count_px : image->height_px;
    ok = ok && (view->quality.reference ? rt_job_run(job, &rt_reference_form, err)
                                        : rt_production_render(job, err));
    if (ok && atomic_load(&job->is_cancelled))
        ok = error_set(err, ERROR_TIMEOUT, "ray tracing was cancelled");
    if (ok && atomic_load(&job->has_no_memory))
        ok = error_set(err, ERROR_NO_MEMORY, "surfaces of a tile of the picture");
    if (ok && atomic_load(&job->has_overflowed))
        ok = error_set(err, ERROR_OVER_BUDGET, "a ray meets more than %d surfaces", RT_HITS_MAX);
    if (!ok)
        image_finish(image);
    return ok;
}

bool raytrace_render(const struct raytrace_desc *desc, struct image *image,
                     struct raytrace_stats *stats, struct error *err)
{
    struct rt_scene own = {0}, *scene;
    struct raytrace_stats measured = {0};
    double begin_ms = wall_ms();
    *image = (struct image){0};
    if (!rt_job_take_scene(desc, &own, &scene, &measured.is_scene_reused, err))
        return false;
    double built_ms = wall_ms();
    rt_scene_withhold(scene, desc->texture_levels);
    struct rt_job job = {.desc = desc, .scene = scene, .image = image};
    bool ok = run_form(&job, err);
    measured.build_ms = built_ms - begin_ms;
    measured.haze_ms = job.haze_ms;
    measured.trace_ms = wall_ms() - built_ms - job.paused_ms - job.haze_ms;
    measured.camera_rays = atomic_load(&job.camera_rays);
    measured.shadow_rays = atomic_load(&job.shadow_rays);
    measured.surfaces = atomic_load(&job.surfaces);
    measured.lights_listed = atomic_load(&job.lights_listed);
    measured.lights_reaching = atomic_load(&job.lights_reaching);
    measured.scene_bytes = rt_scene_size_bytes(scene);
    if (stats)
        *stats = measured;
    rt_scene_finish(&own);
    return ok;
}

bool raytrace_build(const struct raytrace_desc *desc, struct raytrace_stats *stats,
                    struct error *err)
{
    struct rt_scene own = {0}, *scene;
    double begin_ms = wall_ms();
    *stats = (struct raytrace_stats){0};
    if (!rt_job_take_scene(desc, &own, &scene, &stats->is_scene_reused, err))
        return false;
    stats->build_ms = wall_ms() - begin_ms;
    stats->scene_bytes = rt_scene_size_bytes(scene);
    rt_scene_finish(&own);
    return true;
}

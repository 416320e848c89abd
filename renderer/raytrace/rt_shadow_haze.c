/* SPDX-License-Identifier: MIT */
/* Traced shadows in the haze of a rasterised picture. */
#include "renderer/base/wall_clock.h"
#include "renderer/raytrace/rt_haze_grid.h"
#include "renderer/raytrace/rt_shadow_points.h"

static bool check(const struct rt_job *job, struct error *err)
{
    if (atomic_load(&job->is_cancelled))
        return error_set(err, ERROR_TIMEOUT, "tracing shadows in haze was cancelled");
    if (atomic_load(&job->has_overflowed))
        return error_set(err, ERROR_OVER_BUDGET, "a ray meets more than %d surfaces", RT_HITS_MAX);
    return true;
}

bool raytrace_shadows_light_haze(struct raytrace_shadows *shadows,
                                 struct raytrace_shadow_haze *haze, struct raytrace_stats *stats,
                                 struct error *err)
{
    double begin_ms = wall_ms();
    struct rt_haze_grid grid = {.offset = haze->offset};
    struct rt_job job = {.desc = &shadows->desc, .scene = shadows->scene};
    bool ok = rt_haze_grid_place(&grid, &job, haze->size, err) &&
              rt_haze_grid_light(&grid, &job, &shadows->light_set, err) && check(&job, err);
    haze->lights = NULL;
    if (ok) {
        haze->lights = grid.lights;
        grid.lights = NULL;
    }
    rt_haze_grid_finish(&grid);
    stats->haze_ms += wall_ms() - begin_ms - job.paused_ms;
    stats->shadow_rays += atomic_load(&job.shadow_rays);
    return ok;
}

/* SPDX-License-Identifier: MIT */
/* Counts and times of one view. */
#include "tests/bench/forecasts.h"

#include <math.h>

#include "renderer/cost/auto_technique.h"
#include "renderer/cost/workload.h"
#include "renderer/frame/calibrate.h"
#include "tests/bench/frames.h"

enum { TIMED = 2 };

bool forecasts_count_work(const struct rig_scene *rig, const struct view *view,
                          struct workload *workload, struct error *err)
{
    struct scene_state state = {0};
    struct camera camera;
    bool ok = scene_state_init(&state, &rig->imported.scene, view, err) &&
              camera_resolve(&camera, view, &state, err) &&
              workload_measure(
                  workload,
                  &(struct workload_desc){.view = view, .state = &state, .camera = &camera}, err);
    scene_state_finish(&state);
    return ok;
}

bool forecasts_choose(const struct rig_scene *rig, const struct view *view,
                      const struct device_speed *speed, enum shadow_technique *chosen,
                      struct error *err)
{
    const struct auto_settings settings = {.policy = AUTO_MEASURED, .speed = *speed};
    struct scene_state state = {0};
    struct camera camera;
    struct auto_choice choice = {0};
    bool ok = scene_state_init(&state, &rig->imported.scene, view, err) &&
              camera_resolve(&camera, view, &state, err) &&
              auto_choose(&choice,
                          &(struct auto_desc){.view = view,
                                              .state = &state,
                                              .camera = &camera,
                                              .settings = &settings,
                                              .raster_samples = view->quality.samples},
                          err);
    bool has_areas = ok && scene_state_area_lights(&state);
    *chosen = choice.is_open ? choice.technique
              : has_areas    ? SHADOWS_RAYTRACED
                             : SHADOWS_RASTER_DEFAULT;
    scene_state_finish(&state);
    return ok;
}

bool forecasts_time_view(struct bench *bench, const struct rig_scene *rig, const struct view *view,
                         bool is_cold, double *least_ms, struct frame_report *report,
                         struct error *err)
{
    *least_ms = INFINITY;
    for (int frame = -1; frame < TIMED; frame++) {
        struct frame_times times;
        if (!frame_measure(bench_renderer(bench), rig, view, is_cold, &times, report, err))
            return false;
        if (frame >= 0)
            *least_ms = fmin(*least_ms, calibrate_alone_ms(times.wall_ms, times.cpu_ms,
                                                           bench->info.is_software));
    }
    return true;
}

double forecasts_off(double ratio)
{
    return exp(fabs(log(ratio)));
}

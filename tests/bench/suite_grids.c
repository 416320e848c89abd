/* SPDX-License-Identifier: MIT */
/* Suite `grids`: what smoke adds to ray traced and to rasterised frames against its forecast, on
 * generated scenes that costs were not fitted to; --scene fit: on those they were fitted to. With
 * --json the counts and times, for tests/bench/fit_models.py. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/quality_defaults.h"
#include "renderer/cost/technique_forecast.h"
#include "renderer/cost/workload.h"
#include "renderer/frame/calibrate.h"
#include "tests/bench/frames.h"
#include "tests/support/generated_scene.h"

enum { SEEDS = 12, SEEDS_QUICK = 1, SEED_OF_FIT = 1000, TIMED = 1 };
static const double WORST = 2.5, MEDIAN = 1.5; /* factors, either way */

static const enum shadow_technique techniques[] = {SHADOWS_RAYTRACED, SHADOWS_DEEP};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

struct timed {
    double with_ms, without_ms; /* processor time, spread over processors */
    double forecast_ms;         /* of the whole frame with smoke */
    struct workload workload;
};

static bool count_work(const struct rig_scene *rig, const struct view *view,
                       struct workload *workload, struct error *err)
{
    struct scene_state state = {0};
    struct camera camera;
    bool ok = scene_state_init(&state, &rig->imported.scene, view, err) &&
              camera_resolve(&camera, view, &state, err) &&
              workload_measure(
                  workload,
                  &(struct workload_desc){
                      .view = view, .state = &state, .camera = &camera, .depths_bytes = UINT64_MAX},
                  err);
    scene_state_finish(&state);
    return ok;
}

/* The least of the frames after the first, which builds. */
static bool time_view(struct bench *bench, const struct rig_scene *rig, struct view view,
                      double *least_ms, struct error *err)
{
    *least_ms = INFINITY;
    for (int frame = -1; frame < TIMED; frame++) {
        struct frame_times times;
        view.camera.eye[1] += 0.01;
        if (!frame_measure(bench_renderer(bench), rig, &view, false, &times, NULL, err))
            return false;
        if (frame >= 0)
            *least_ms = fmin(*least_ms, calibrate_alone_ms(times.wall_ms, times.cpu_ms, true));
    }
    return true;
}

static bool time_case(struct bench *bench, const struct rig_scene *rig, const struct view *from,
                      enum shadow_technique shadows, const struct device_speed *speed,
                      struct timed *timed, struct error *err)
{
    static const struct view_grid_override none[2] = {{.grid = "Smoke", .has_density = true},
                                                      {.grid = "More smoke", .has_density = true}};
    struct view view = *from;
    int size[2];
    bench_size(bench, view.width_px / 4, view.height_px / 4, size);
    view.width_px = size[0];
    view.height_px = size[1];
    view.quality.shadows = shadows;
    struct view bare = view;
    bare.grids = none;
    bare.grid_override_count = rig->imported.scene.grid_count;
    const struct forecast_setting setting = {
        .samples = view.quality.samples,
        .shadow_resolution =
            shadow_technique_has(shadows, SHADOW_HAS_RESOLUTION) ? SHADOW_RESOLUTION_DEFAULT : 0,
        .shadow_taps = shadow_technique_taps(shadows, 0),
        .has_shadows = true,
        .is_warm = true};
    if (!count_work(rig, &view, &timed->workload, err) ||
        !time_view(bench, rig, bare, &timed->without_ms, err) ||
        !time_view(bench, rig, view, &timed->with_ms, err))
        return false;
    timed->forecast_ms =
        technique_forecast_ms(shadows, &(struct forecast_frame){&timed->workload, &setting, speed});
    return true;
}

static void tell(struct bench *bench, const char *name, const char *technique, int samples,
                 const struct timed *t, struct samples *off)
{
    const struct workload *w = &t->workload;
    double factor = t->forecast_ms / t->with_ms;
    samples_add(off, exp(fabs(log(factor))));
    fprintf(bench->options.is_json ? stderr : stdout,
            "  %-36.36s %-9s %8.1f without, %8.1f with smoke, forecast %8.1f  %5.2f\n", name,
            technique, t->without_ms, t->with_ms, t->forecast_ms, factor);
    json_array_append_new(
        bench->results,
        json_pack(
            "{s:s,s:s,s:s,s:i,s:f,s:f,s:f,s:{s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f}}",
            "suite", bench->suite, "scene", name, "technique", technique, "samples", samples,
            "with_ms", t->with_ms, "without_ms", t->without_ms, "forecast_ms", t->forecast_ms,
            "workload", "pixels", w->pixels, "covered", w->covered, "layers", w->layers, "lit",
            w->lit, "triangles", w->triangles, "grid_cells", w->grid_cells, "grid_lights",
            w->grid_lights, "grid_lit_cells", w->grid_lit_cells, "grid_shadow_cells",
            w->grid_shadow_cells, "grid_nodes", w->grid_nodes, "grid_node_lights",
            w->grid_node_lights, "grid_node_cells", w->grid_node_cells));
}

static bool run_case(struct bench *bench, uint64_t seed, const struct device_speed *speed,
                     struct samples off[TECHNIQUES], struct error *err)
{
    struct generated_scene *scene = calloc(1, sizeof *scene);
    struct rig_scene rig = {0};
    struct timed timed;
    char key[32];
    snprintf(key, sizeof key, "smoky-%d", (int)seed);
    bool ok = scene ? generated_scene_make_smoky(scene, seed, err)
                    : error_set(err, ERROR_NO_MEMORY, "scene");
    ok = ok &&
         rig_scene_from_glb(&rig, bench_renderer(bench), key, scene->glb, scene->glb_bytes, err);
    for (int i = 0; ok && i < TECHNIQUES; i++) {
        ok = time_case(bench, &rig, &scene->view, techniques[i], speed, &timed, err);
        if (ok)
            tell(bench, scene->name, shadow_technique_name((int)techniques[i]),
                 scene->view.quality.samples, &timed, &off[i]);
    }
    rig_scene_finish(&rig, bench_renderer(bench));
    if (scene)
        generated_scene_finish(scene);
    free(scene);
    return ok;
}

static void check(struct bench *bench, const char *technique, const char *name, double value,
                  double bound)
{
    bench_check(bench, &(struct check){.scene = "generated",
                                       .subject = technique,
                                       .name = name,
                                       .value = value,
                                       .relation = bench->options.is_quick ? NULL : "<=",
                                       .bound = bound,
                                       .p = NAN});
}

bool suite_grids(struct bench *bench, struct error *err)
{
    struct calibration calibration;
    struct samples off[TECHNIQUES] = {{0}};
    bool is_fit = bench->options.scene && strcmp(bench->options.scene, "fit") == 0;
    int seeds = bench->options.is_quick ? SEEDS_QUICK : SEEDS;
    bool ok = renderer_calibrate(bench_renderer(bench), &calibration, err);
    if (ok)
        json_array_append_new(bench->results,
                              json_pack("{s:s,s:f,s:f}", "suite", "speed", "trace",
                                        calibration.speed.trace, "shade", calibration.speed.shade));
    for (int i = 0; ok && i < seeds; i++)
        ok = run_case(bench, (uint64_t)i + 1 + (is_fit ? SEED_OF_FIT : 0), &calibration.speed, off,
                      err);
    for (int i = 0; i < TECHNIQUES; i++) {
        const char *technique = shadow_technique_name((int)techniques[i]);
        if (ok) {
            check(bench, technique, "smoke, forecast off by a factor of, median",
                  samples_summary(&off[i]).median, MEDIAN);
            check(bench, technique, "smoke, forecast off by a factor of, 95 %",
                  samples_summary(&off[i]).p95, WORST);
        }
        samples_finish(&off[i]);
    }
    return ok;
}

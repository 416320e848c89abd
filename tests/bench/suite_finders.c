/* SPDX-License-Identifier: MIT */
/* Suite `finders`: what shadow volumes and grids of triangles take against their forecasts, on
 * grids of spheres and on generated scenes; --scene fit: others, to which the costs were fitted.
 * With --json the counts and times. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "renderer/cost/technique_forecast.h"
#include "renderer/frame/calibrate.h"
#include "tests/bench/forecasts.h"
#include "tests/bench/scenes.h"
#include "tests/support/generated_scene.h"

enum { SEEDS = 12, SEEDS_QUICK = 1, SEED_OF_FIT = 2000, LIGHTS = 4 };

static const struct technique {
    const char *name;
    enum shadow_technique shadows;
} techniques[] = {
    {"none", SHADOWS_NONE},
    {"volume", SHADOWS_VOLUME},
    {"silhouette", SHADOWS_SILHOUETTE},
    {"area", SHADOWS_AREA},
};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

static void tell(struct bench *bench, const char *name, const struct technique *technique,
                 const struct view *view, const struct workload *w, double took_ms,
                 double forecast_ms)
{
    fprintf(bench->options.is_json ? stderr : stdout,
            "  %-30.30s %-12s %8.1f ms, forecast %8.1f  %5.2f; %.0f triangles\n", name,
            technique->name, took_ms, forecast_ms, forecast_ms / took_ms, w->triangles);
    json_t *work = json_pack("{s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f}", "pixels",
                             w->pixels, "covered", w->covered, "layers", w->layers, "lit", w->lit,
                             "listed", w->listed, "triangles", w->triangles, "triangles_in_view",
                             w->triangles_in_view, "shadowed_lights", (double)w->shadowed_lights,
                             "map_faces", w->map_faces, "map_triangles", w->map_triangles,
                             "deep_triangles", w->deep_triangles, "side_pixels", w->side_pixels);
    json_array_append_new(bench->results,
                          json_pack("{s:s,s:s,s:s,s:i,s:f,s:f,s:o}", "suite", bench->suite, "scene",
                                    name, "variant", technique->name, "samples",
                                    view->quality.samples, "ms", took_ms, "forecast_ms",
                                    forecast_ms, "workload", work));
}

static bool run_technique(struct bench *bench, const char *name, const struct rig_scene *rig,
                          struct view view, const struct technique *technique,
                          const struct device_speed *speed, struct samples *off, struct error *err)
{
    struct frame_report report;
    struct workload workload;
    double took_ms;
    view.quality.shadows = technique->shadows;
    const struct forecast_setting setting = {.samples = view.quality.samples,
                                             .has_shadows = technique->shadows != SHADOWS_NONE,
                                             .is_warm = true};
    if (!forecasts_count_work(rig, &view, &workload, err) ||
        !forecasts_time_view(bench, rig, &view, false, &took_ms, &report, err))
        return false;
    double forecast_ms = technique_forecast_ms(
        technique->shadows, &(struct forecast_frame){&workload, &setting, speed});
    samples_add(off, forecasts_off(forecast_ms / took_ms));
    tell(bench, name, technique, &view, &workload, took_ms, forecast_ms);
    return true;
}

static bool run_techniques(struct bench *bench, const char *name, const struct rig_scene *rig,
                           const struct view *view, const struct device_speed *speed,
                           struct samples off[TECHNIQUES], struct error *err)
{
    for (int i = 0; i < TECHNIQUES; i++)
        if (!run_technique(bench, name, rig, *view, &techniques[i], speed, &off[i], err))
            return false;
    return true;
}

static bool run_generated(struct bench *bench, uint64_t seed, const struct device_speed *speed,
                          struct samples off[TECHNIQUES], struct error *err)
{
    struct generated_scene *scene = calloc(1, sizeof *scene);
    struct rig_scene rig = {0};
    char key[32];
    snprintf(key, sizeof key, "finders-%d", (int)seed);
    bool ok =
        scene ? generated_scene_make(scene, seed, err) : error_set(err, ERROR_NO_MEMORY, "scene");
    if (ok) {
        struct view view = scene->view;
        view.light_count = view.light_count < LIGHTS ? view.light_count : LIGHTS;
        ok = rig_scene_from_glb(&rig, bench_renderer(bench), key, scene->glb, scene->glb_bytes,
                                err) &&
             run_techniques(bench, scene->name, &rig, &view, speed, off, err);
    }
    rig_scene_finish(&rig, bench_renderer(bench));
    if (scene)
        generated_scene_finish(scene);
    free(scene);
    return ok;
}

static bool run_spheres(struct bench *bench, int stacks, int lights,
                        const struct device_speed *speed, struct samples off[TECHNIQUES],
                        struct error *err)
{
    struct rig_scene rig = {0};
    char name[48];
    struct view_light lamps[LIGHTS];
    for (int i = 0; i < lights; i++)
        lamps[i] = (struct view_light){.type = SCENE_LIGHT_POINT,
                                       .position = {3 - 2.5 * i, 9, 2 + i},
                                       .color = {1, 1, 1},
                                       .intensity = 300};
    const struct view view = {.width_px = 320,
                              .height_px = 240,
                              .outputs = 1u << VIEW_OUTPUT_COLOR,
                              .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                         .eye = {7, 6, 8},
                                         .target = {0, 0.3, 0},
                                         .fov_y_deg = 45},
                              .lights = lamps,
                              .light_count = (size_t)lights,
                              .ignore_scene_lights = true,
                              .quality = {.samples = 1}};
    snprintf(name, sizeof name, "spheres of %d, %d lights", 4 * stacks * (stacks - 1), lights);
    bool ok = bench_spheres_open(&rig, bench_renderer(bench), stacks, err) &&
              run_techniques(bench, name, &rig, &view, speed, off, err);
    rig_scene_finish(&rig, bench_renderer(bench));
    return ok;
}

static bool run_all(struct bench *bench, const struct device_speed *speed,
                    struct samples off[TECHNIQUES], struct error *err)
{
    static const int stacks[] = {3, 8, 20}, stacks_of_fit[] = {4, 10, 30};
    bool is_fit = bench->options.scene && strcmp(bench->options.scene, "fit") == 0;
    bool is_quick = bench->options.is_quick, ok = true;
    for (int i = 0; ok && i < (is_quick ? 1 : 3); i++)
        ok = run_spheres(bench, (is_fit ? stacks_of_fit : stacks)[i], 1 + i % 2, speed, off, err);
    for (int i = 0; ok && i < (is_quick ? SEEDS_QUICK : SEEDS); i++)
        ok = run_generated(bench, (uint64_t)i + 1 + (is_fit ? SEED_OF_FIT : 0), speed, off, err);
    return ok;
}

static void check(struct bench *bench, const char *subject, const char *name, double value)
{
    bench_check(
        bench,
        &(struct check){
            .scene = "generated", .subject = subject, .name = name, .value = value, .p = NAN});
}

bool suite_finders(struct bench *bench, struct error *err)
{
    struct calibration calibration;
    struct samples off[TECHNIQUES];
    memset(off, 0, sizeof off);
    bool ok = renderer_calibrate(bench_renderer(bench), &calibration, err);
    if (ok)
        json_array_append_new(bench->results,
                              json_pack("{s:s,s:f,s:f,s:f}", "suite", "speed", "shade",
                                        calibration.speed.shade, "maps", calibration.speed.maps,
                                        "frame", calibration.speed.frame_ms));
    ok = ok && run_all(bench, &calibration.speed, off, err);
    for (int i = 0; i < TECHNIQUES; i++) {
        if (ok && off[i].count) {
            check(bench, techniques[i].name, "off by a factor of, median",
                  samples_summary(&off[i]).median);
            check(bench, techniques[i].name, "off by a factor of, 95 %",
                  samples_summary(&off[i]).p95);
        }
        samples_finish(&off[i]);
    }
    return ok;
}

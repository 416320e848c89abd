/* SPDX-License-Identifier: MIT */
/* Suite `peels`: what peeling transparent layers, and shadow maps with several of them, take
 * against their forecasts, on the demo scene and on generated ones; --scene fit: on other seeds.
 * Costs were fitted to both. With --json the counts and times. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/cost/technique_forecast.h"
#include "renderer/frame/calibrate.h"
#include "tests/bench/forecasts.h"
#include "tests/bench/scenes.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/generated_scene.h"

enum { SEEDS = 12, SEEDS_QUICK = 1, SEED_OF_FIT = 2000, LIGHTS = 2, PANE_SEEDS = 8 };

static const struct variant {
    const char *name;
    enum shadow_technique shadows;
    enum transparency transparency;
    bool is_cold; /* its shadow maps are what is timed */
} variants[] = {
    {"lists", SHADOWS_NONE, TRANSPARENCY_LISTS, false},
    {"depth-peeling", SHADOWS_NONE, TRANSPARENCY_DEPTH_PEELING, false},
    {"dual-depth-peeling", SHADOWS_NONE, TRANSPARENCY_DUAL_DEPTH_PEELING, false},
    {"deep", SHADOWS_DEEP, TRANSPARENCY_LISTS, true},
    {"composited", SHADOWS_COMPOSITED, TRANSPARENCY_LISTS, true},
};
enum { VARIANTS = sizeof variants / sizeof *variants };

static void tell(struct bench *bench, const char *name, const struct variant *variant,
                 const struct view *view, const struct workload *w,
                 const struct frame_report *report, double took_ms, double forecast_ms)
{
    const struct report_counts *counts = &report->counts;
    fprintf(bench->options.is_json ? stderr : stdout,
            "  %-30.30s %-18s %8.1f ms, forecast %8.1f  %5.2f; layers %d, peels %.0f, "
            "map layers %.1f\n",
            name, variant->name, took_ms, forecast_ms, forecast_ms / took_ms,
            (int)counts->longest_pixel_list, w->peels, w->deep_layers);
    json_t *work = json_pack(
        "{s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f}", "pixels", w->pixels, "layers", w->layers,
        "peeled_sides", w->peeled_sides, "peels", w->peels, "peeled_pixels", w->peeled_pixels,
        "peeled_triangles", w->peeled_triangles, "deep_faces", w->deep_faces, "deep_triangles",
        w->deep_triangles, "deep_share", w->deep_share, "deep_layers", w->deep_layers);
    json_array_append_new(bench->results,
                          json_pack("{s:s,s:s,s:s,s:i,s:f,s:f,s:i,s:i,s:o}", "suite", bench->suite,
                                    "scene", name, "variant", variant->name, "samples",
                                    view->quality.samples, "ms", took_ms, "forecast_ms",
                                    forecast_ms, "longest", (int)counts->longest_pixel_list,
                                    "peeled", (int)counts->peeled_layers, "workload", work));
}

static bool run_variant(struct bench *bench, const char *name, const struct rig_scene *rig,
                        const struct view *from, const struct variant *variant,
                        const struct device_speed *speed, double *ratio, struct error *err)
{
    struct view view = *from;
    struct frame_report report;
    struct workload workload;
    double took_ms;
    view.light_count = view.light_count < LIGHTS ? view.light_count : LIGHTS;
    view.quality.shadow_resolution = 512;
    view.quality.shadows = variant->shadows;
    view.quality.transparency = variant->transparency;
    const struct forecast_setting setting = {.samples = view.quality.samples,
                                             .shadow_resolution = view.quality.shadow_resolution,
                                             .shadow_taps = 4,
                                             .has_shadows = variant->shadows != SHADOWS_NONE,
                                             .is_warm = !variant->is_cold};
    if (!forecasts_count_work(rig, &view, &workload, err) ||
        !forecasts_time_view(bench, rig, &view, variant->is_cold, &took_ms, &report, err))
        return false;
    double forecast_ms = technique_forecast_ms(
        variant->shadows, &(struct forecast_frame){&workload, &setting, speed});
    *ratio = forecast_ms / took_ms;
    tell(bench, name, variant, &view, &workload, &report, took_ms, forecast_ms);
    return true;
}

static bool run_variants(struct bench *bench, const char *name, const struct rig_scene *rig,
                         const struct view *view, const struct device_speed *speed,
                         struct samples off[VARIANTS], struct error *err)
{
    for (int i = 0; i < VARIANTS; i++) {
        double ratio;
        if (!run_variant(bench, name, rig, view, &variants[i], speed, &ratio, err))
            return false;
        samples_add(&off[i], forecasts_off(ratio));
    }
    return true;
}

/* Those with glass. */
static bool run_generated(struct bench *bench, uint64_t seed, const struct device_speed *speed,
                          struct samples off[VARIANTS], struct error *err)
{
    struct generated_scene *scene = calloc(1, sizeof *scene);
    struct rig_scene rig = {0};
    char key[32];
    snprintf(key, sizeof key, "peels-%d", (int)seed);
    bool ok =
        scene ? generated_scene_make(scene, seed, err) : error_set(err, ERROR_NO_MEMORY, "scene");
    if (ok && (scene->kind == GENERATED_PANES || scene->kind == GENERATED_SPHERES))
        ok = rig_scene_from_glb(&rig, bench_renderer(bench), key, scene->glb, scene->glb_bytes,
                                err) &&
             run_variants(bench, scene->name, &rig, &scene->view, speed, off, err);
    rig_scene_finish(&rig, bench_renderer(bench));
    if (scene)
        generated_scene_finish(scene);
    free(scene);
    return ok;
}

static bool run_demo(struct bench *bench, const struct device_speed *speed,
                     struct samples off[VARIANTS], struct error *err)
{
    struct bench_scene scene;
    struct view_light spot;
    bool ok = bench_demo_open(&scene, bench_renderer(bench), err);
    if (ok) {
        struct view view = bench_scene_view(&scene, (int[]){480, 270});
        bench_scene_spots(&scene, &spot, 1);
        view.outputs = 1u << VIEW_OUTPUT_COLOR;
        view.lights = &spot;
        view.light_count = 1;
        view.quality.refraction = VIEW_REFRACTION_OFF;
        view.quality.shadow_taps = 4;
        ok = run_variants(bench, "demo", &scene.rig, &view, speed, off, err);
    }
    bench_scene_close(&scene, bench_renderer(bench));
    return ok;
}

/* Panes that lie before one another, from the side. */
static bool run_panes(struct bench *bench, uint64_t seed, const struct device_speed *speed,
                      struct samples off[VARIANTS], struct error *err)
{
    struct closed_form_scene scene;
    struct rig_scene rig = {0};
    char name[32];
    int count = 5 << seed % 4;
    const struct random_panes_scene_desc desc = {
        .pane_count = count, .seed = seed, .light = GLB_LIGHT_SPOT};
    const struct view view = {.width_px = 320 + 160 * (int)(seed % 3),
                              .height_px = 180 + 90 * (int)(seed % 3),
                              .outputs = 1u << VIEW_OUTPUT_COLOR,
                              .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                         .eye = {3 - (double)(seed % 5), 3, 5 + (double)(seed % 4)},
                                         .target = {0, 2.4, 0},
                                         .fov_y_deg = 45},
                              .quality = {.samples = seed % 2 ? 1 : 4, .shadow_taps = 4}};
    random_panes_scene_build(&desc, &scene);
    snprintf(name, sizeof name, "panes-%d, seed %d", count, (int)seed);
    bool ok =
        rig_scene_from_glb(&rig, bench_renderer(bench), name, scene.glb, scene.size_bytes, err) &&
        run_variants(bench, name, &rig, &view, speed, off, err);
    rig_scene_finish(&rig, bench_renderer(bench));
    closed_form_scene_finish(&scene);
    return ok;
}

static void check(struct bench *bench, const char *subject, const char *name, double value)
{
    bench_check(
        bench,
        &(struct check){
            .scene = "generated", .subject = subject, .name = name, .value = value, .p = NAN});
}

bool suite_peels(struct bench *bench, struct error *err)
{
    struct calibration calibration;
    struct samples off[VARIANTS];
    memset(off, 0, sizeof off);
    bool is_fit = bench->options.scene && strcmp(bench->options.scene, "fit") == 0;
    int seeds = bench->options.is_quick ? SEEDS_QUICK : SEEDS;
    bool ok = renderer_calibrate(bench_renderer(bench), &calibration, err);
    if (ok)
        json_array_append_new(bench->results,
                              json_pack("{s:s,s:f,s:f,s:f}", "suite", "speed", "shade",
                                        calibration.speed.shade, "maps", calibration.speed.maps,
                                        "frame", calibration.speed.frame_ms));
    ok = ok && run_demo(bench, &calibration.speed, off, err);
    for (int i = 0; ok && i < seeds; i++)
        ok = run_generated(bench, (uint64_t)i + 1 + (is_fit ? SEED_OF_FIT : 0), &calibration.speed,
                           off, err);
    for (int i = 0; ok && i < (bench->options.is_quick ? 1 : PANE_SEEDS); i++)
        ok = run_panes(bench, (uint64_t)i + 1 + (is_fit ? SEED_OF_FIT : 0), &calibration.speed, off,
                       err);
    for (int i = 0; i < VARIANTS; i++) {
        if (ok && off[i].count) {
            check(bench, variants[i].name, "off by a factor of, median",
                  samples_summary(&off[i]).median);
            check(bench, variants[i].name, "off by a factor of, 95 %",
                  samples_summary(&off[i]).p95);
        }
        samples_finish(&off[i]);
    }
    return ok;
}

/* SPDX-License-Identifier: MIT */
/* Suite `finders`: what shadow volumes and grids of triangles take against their forecasts, on
 * grids of spheres and on generated scenes; --scene fit: others, to which the costs were fitted.
 * --scene areas: generated scenes under lights that have an area, by all techniques that draw
 * these, and what `auto` takes; --scene areas-fit. --scene choice: likewise of those under points
 * and spots. With --json the counts and times. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "protocol/quality_defaults.h"
#include "renderer/cost/technique_forecast.h"
#include "renderer/frame/calibrate.h"
#include "tests/bench/forecasts.h"
#include "tests/bench/scenes.h"
#include "tests/support/generated_scene.h"
#include "tests/support/light_scene.h"

enum { SEEDS = 12, SEEDS_QUICK = 1, SEED_OF_FIT = 2000, LIGHTS = 4 };
/* More are never taken, and take up to a minute a frame. */
enum { AREA_TRIANGLES = 65000 };

static const struct technique {
    const char *name;
    enum shadow_technique shadows;
} techniques[] = {
    {"none", SHADOWS_NONE},
    {"volume", SHADOWS_VOLUME},
    {"silhouette", SHADOWS_SILHOUETTE},
    {"area", SHADOWS_AREA},
    {"raytraced-shadows", SHADOWS_RAYTRACED_SHADOWS},
    {"raytraced", SHADOWS_RAYTRACED},
    {"maps", SHADOWS_RASTER_DEFAULT},
};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

static bool is_named(const struct bench *bench, const char *name)
{
    return bench->options.scene && strcmp(bench->options.scene, name) == 0;
}

static bool is_of_areas(const struct bench *bench)
{
    return is_named(bench, "areas") || is_named(bench, "areas-fit");
}

static bool tells_choice(const struct bench *bench)
{
    return is_of_areas(bench) || is_named(bench, "choice");
}

/* Rays are held against frames under points by other suites (`forecast`, `auto`). */
static bool is_compared(const struct bench *bench, enum shadow_technique shadows)
{
    if (is_named(bench, "choice"))
        return shadows != SHADOWS_NONE;
    if (shadows == SHADOWS_RASTER_DEFAULT)
        return false;
    bool is_of_points = shadows == SHADOWS_VOLUME || shadows == SHADOWS_SILHOUETTE;
    bool is_of_rays = shadows == SHADOWS_RAYTRACED_SHADOWS || shadows == SHADOWS_RAYTRACED;
    return is_of_areas(bench) ? !is_of_points : !is_of_rays;
}

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
                             "deep_triangles", w->deep_triangles, "face_pixels", w->face_pixels);
    json_array_append_new(
        bench->results, json_pack("{s:s,s:s,s:s,s:i,s:i,s:f,s:f,s:o}", "suite", bench->suite,
                                  "scene", name, "variant", technique->name, "samples",
                                  view->quality.samples, "area_samples", view->quality.area_samples,
                                  "ms", took_ms, "forecast_ms", forecast_ms, "workload", work));
}

static bool run_technique(struct bench *bench, const char *name, const struct rig_scene *rig,
                          struct view view, const struct technique *technique,
                          const struct device_speed *speed, struct samples *off, double *took,
                          struct error *err)
{
    struct frame_report report;
    struct workload workload;
    double took_ms;
    view.quality.shadows = technique->shadows;
    const struct forecast_setting setting = {.samples = view.quality.samples,
                                             .has_shadows = technique->shadows != SHADOWS_NONE,
                                             .shadow_taps = SHADOW_TAPS_DEFAULT,
                                             .shadow_resolution = SHADOW_RESOLUTION_DEFAULT,
                                             .is_warm = true};
    if (!forecasts_count_work(rig, &view, &workload, err))
        return false;
    if (tells_choice(bench) && technique->shadows == SHADOWS_AREA &&
        workload.triangles > AREA_TRIANGLES) {
        *took = INFINITY;
        return true;
    }
    if (!forecasts_time_view(bench, rig, &view, false, &took_ms, &report, err))
        return false;
    double forecast_ms = technique_forecast_ms(
        technique->shadows, &(struct forecast_frame){&workload, &setting, speed});
    samples_add(off, forecasts_off(forecast_ms / took_ms));
    *took = took_ms;
    tell(bench, name, technique, &view, &workload, took_ms, forecast_ms);
    return true;
}

/* How much longer than the fastest what `auto` takes is, of those that are compared. */
static bool tell_choice(struct bench *bench, const char *name, const struct rig_scene *rig,
                        struct view view, const struct device_speed *speed,
                        const double took_ms[SHADOWS_COUNT], struct samples *over,
                        struct error *err)
{
    enum shadow_technique chosen, best = SHADOWS_RAYTRACED;
    view.quality.shadows = SHADOWS_AUTO;
    view.quality.shadow_taps = view.quality.shadow_resolution = 0;
    view.quality.expects_reuse = true;
    if (!forecasts_choose(rig, &view, speed, &chosen, err))
        return false;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (i != SHADOWS_NONE && took_ms[i] > 0 && took_ms[i] < took_ms[best])
            best = (enum shadow_technique)i;
    samples_add(over, took_ms[chosen] / took_ms[best]);
    fprintf(bench->options.is_json ? stderr : stdout, "  %-30.30s auto: %s, %.2f of %s\n", name,
            shadow_technique_name((int)chosen), took_ms[chosen] / took_ms[best],
            shadow_technique_name((int)best));
    return true;
}

static bool run_techniques(struct bench *bench, const char *name, const struct rig_scene *rig,
                           const struct view *view, const struct device_speed *speed,
                           struct samples off[TECHNIQUES + 1], struct error *err)
{
    double took_ms[SHADOWS_COUNT] = {0};
    for (int i = 0; i < TECHNIQUES; i++)
        if (is_compared(bench, techniques[i].shadows) &&
            !run_technique(bench, name, rig, *view, &techniques[i], speed, &off[i],
                           &took_ms[techniques[i].shadows], err))
            return false;
    return !tells_choice(bench) ||
           tell_choice(bench, name, rig, *view, speed, took_ms, &off[TECHNIQUES], err);
}

/* Rectangles and disks in the place of its lights, with 4 to 64 points each. */
static void widen_lights(struct view *view, struct view_light *lights, uint64_t seed)
{
    uint64_t state = 0xd1342543de82ef95u * (seed + 3);
    for (size_t i = 0; i < view->light_count; i++) {
        bool is_disk = random_next(&state) % 2;
        double size_m = random_log_uniform(&state, 0.2, 2);
        lights[i] = (struct view_light){
            .type = is_disk ? SCENE_LIGHT_DISK : SCENE_LIGHT_RECT,
            .direction = {lights[i].direction[0], -1, lights[i].direction[2]},
            .color = {1, 1, 1},
            .intensity = (float)(300 / (size_m * size_m * (double)view->light_count)),
            .range = lights[i].range,
            .width_m = is_disk ? 0 : size_m,
            .height_m = is_disk ? 0 : size_m * random_uniform(&state, 0.3, 1),
            .radius_m = is_disk ? size_m / 2 : 0,
            .position = {lights[i].position[0], lights[i].position[1], lights[i].position[2]},
        };
    }
    view->quality.area_samples = 4 << 2 * (random_next(&state) % 3);
}

static bool run_generated(struct bench *bench, uint64_t seed, const struct device_speed *speed,
                          struct samples off[TECHNIQUES + 1], struct error *err)
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
        if (is_of_areas(bench))
            widen_lights(&view, scene->lights, seed);
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
                        const struct device_speed *speed, struct samples off[TECHNIQUES + 1],
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
                    struct samples off[TECHNIQUES + 1], struct error *err)
{
    static const int stacks[] = {3, 8, 20}, stacks_of_fit[] = {4, 10, 30};
    bool is_fit = is_named(bench, "fit") || is_named(bench, "areas-fit");
    bool is_quick = bench->options.is_quick, ok = true;
    for (int i = 0; ok && !tells_choice(bench) && i < (is_quick ? 1 : 3); i++)
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
    struct samples off[TECHNIQUES + 1];
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
    if (ok && off[TECHNIQUES].count) {
        check(bench, "auto", "over the fastest, median", samples_summary(&off[TECHNIQUES]).median);
        check(bench, "auto", "over the fastest, 95 %", samples_summary(&off[TECHNIQUES]).p95);
    }
    samples_finish(&off[TECHNIQUES]);
    return ok;
}

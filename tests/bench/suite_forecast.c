/* SPDX-License-Identifier: MIT */
/* Suite `forecast`: how well the models behind `auto` tell time. Each scene as a request without
 * camera and lights sees it, rasterised, ray traced, and rasterised with traced shadows, cold and
 * warm, with 1 and 4 samples; beside it what was counted and what was forecast after measuring this
 * device. tests/bench/fit_models.py fits the costs of renderer/forecast/forecast.c to the JSON. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "glb/demo_scene.h"
#include "renderer/cost/auto_technique.h"
#include "renderer/cost/technique_forecast.h"
#include "renderer/cost/workload.h"
#include "renderer/frame/calibrate.h"
#include "tests/bench/frames.h"
#include "tests/support/render_support.h"

static const char *const assets[] = {
    "CornellBox/CornellBox.glb",
    "glass-table/glass-table.glb",
    "Sponza/glTF/Sponza.gltf",
    "ToyCar/glTF/ToyCar.gltf",
    "2CylinderEngine/2CylinderEngine.glb",
    "StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf",
    "AlphaBlendModeTest/glTF-Binary/AlphaBlendModeTest.glb",
    "LightsPunctualLamp/glTF/LightsPunctualLamp.gltf",
    "Box/glTF-Binary/Box.glb",
    "GlassVaseFlowers/glTF-Binary/GlassVaseFlowers.glb",
    "TransmissionTest/glTF-Binary/TransmissionTest.glb",
    "RevelryJackOLantern/jack-o-lantern.gltf",
    "SheenChair/glTF/SheenChair.gltf",
    "Duck/glTF-Binary/Duck.glb",
    "Lights-playcanvas/Lights.glb",
    "ShapeCollection/ShapeCollection.glb",
    "MetalRoughSpheresNoTextures/glTF-Binary/MetalRoughSpheresNoTextures.glb",
};
enum { ASSETS = sizeof assets / sizeof *assets, ROUNDS = 2 };

enum technique { MAPS, RAYS, TRACED_SHADOWS, TECHNIQUES };

static const struct {
    const char *name; /* in the JSON */
    enum shadow_technique shadows;
    bool is_on_processors; /* whatever the device */
} techniques[TECHNIQUES] = {
    [MAPS] = {"raster", SHADOWS_DEEP, false},
    [RAYS] = {"raytraced", SHADOWS_RAYTRACED, true},
    [TRACED_SHADOWS] = {"raytraced_shadows", SHADOWS_RAYTRACED_SHADOWS, true},
};

struct tally { /* over all cases */
    struct samples ratios[TECHNIQUES];
    int cases, right;
    double lost_ms, best_ms; /* by the choice, and of the fastest technique */
};

/* What one technique took, the least of its rounds, and was forecast to take. */
struct timed {
    double wall_ms[2], cpu_ms[2], alone_ms[2], forecast_ms[2]; /* cold, warm */
};

static bool time_technique(struct bench *bench, const struct rig_scene *rig,
                           const struct view *view, struct timed *timed, struct error *err)
{
    struct renderer *renderer = bench_renderer(bench);
    for (int round = 0; round <= ROUNDS; round++) { /* the first compiles */
        renderer_drop_structures(renderer, rig->key);
        for (int warm = 0; warm < 2; warm++) {
            struct frame_times times;
            if (!frame_measure(renderer, rig, view, false, &times, NULL, err))
                return false;
            if (round == 0)
                continue;
            bool is_first = round == 1;
            if (is_first || times.wall_ms < timed->wall_ms[warm])
                timed->wall_ms[warm] = times.wall_ms;
            if (is_first || times.cpu_ms < timed->cpu_ms[warm])
                timed->cpu_ms[warm] = times.cpu_ms;
        }
    }
    return true;
}

static bool count(const struct rig_scene *rig, const struct view *view, struct workload *workload,
                  struct error *err)
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

static json_t *describe_work(const struct workload *w)
{
    return json_pack("{s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f}", "pixels", w->pixels,
                     "covered", w->covered, "layers", w->layers, "lit", w->lit, "textures",
                     w->textures, "triangles", w->triangles, "triangles_in_view",
                     w->triangles_in_view, "map_faces", w->map_faces, "deep_faces", w->deep_faces,
                     "map_triangles", w->map_triangles, "deep_triangles", w->deep_triangles,
                     "deep_share", w->deep_share, "shadowed_lights", (double)w->shadowed_lights);
}

static json_t *describe_times(const struct timed *timed)
{
    return json_pack("{s:[f,f],s:[f,f],s:[f,f],s:[f,f]}", "wall_ms", timed->wall_ms[0],
                     timed->wall_ms[1], "cpu_ms", timed->cpu_ms[0], timed->cpu_ms[1], "alone_ms",
                     timed->alone_ms[0], timed->alone_ms[1], "forecast_ms", timed->forecast_ms[0],
                     timed->forecast_ms[1]);
}

/* As renderer/cost/auto_technique.c has it. */
static enum technique choose(const struct timed timed[TECHNIQUES], int warm)
{
    double forecast_ms[SHADOWS_COUNT] = {0};
    int chosen = 0;
    for (int i = 0; i < TECHNIQUES; i++)
        forecast_ms[techniques[i].shadows] = timed[i].forecast_ms[warm];
    while (techniques[chosen].shadows != auto_fastest(forecast_ms))
        chosen++;
    return (enum technique)chosen;
}

static void add_to_tally(struct tally *tally, const struct timed timed[TECHNIQUES], int warm,
                         enum technique chosen)
{
    double best = INFINITY;
    for (int i = 0; i < TECHNIQUES; i++) {
        best = fmin(best, timed[i].alone_ms[warm]);
        samples_add(&tally->ratios[i], timed[i].forecast_ms[warm] / timed[i].alone_ms[warm]);
    }
    tally->cases++;
    tally->right += timed[chosen].alone_ms[warm] <= best;
    tally->lost_ms += timed[chosen].alone_ms[warm] - best;
    tally->best_ms += best;
}

static void tell(struct bench *bench, const char *name, int samples, const struct workload *work,
                 const struct timed timed[TECHNIQUES], const struct timed *bare,
                 struct tally *tally)
{
    json_t *line =
        json_pack("{s:s,s:s,s:i,s:o,s:o}", "suite", bench->suite, "scene", name, "samples", samples,
                  "workload", describe_work(work), "bare", describe_times(bare));
    for (int i = 0; i < TECHNIQUES; i++)
        json_object_set_new(line, techniques[i].name, describe_times(&timed[i]));
    json_array_append_new(bench->results, line);
    for (int warm = 0; warm < 2; warm++) {
        enum technique chosen = choose(timed, warm);
        add_to_tally(tally, timed, warm, chosen);
        if (bench->options.is_json)
            continue;
        printf("  %-22.22s %d %-4s", name, samples, warm ? "warm" : "cold");
        for (int i = 0; i < TECHNIQUES; i++)
            printf(" %8.1f %8.1f  ", timed[i].forecast_ms[warm], timed[i].alone_ms[warm]);
        printf("%s\n", techniques[chosen].name);
    }
}

static bool run_scene(struct bench *bench, const char *name, const struct rig_scene *rig,
                      const struct device_speed *speed, struct tally *tally, struct error *err)
{
    int size[2];
    bench_size(bench, 320, 180, size);
    for (int samples = 1; samples <= (bench->options.is_quick ? 1 : 4); samples += 3) {
        struct timed timed[TECHNIQUES], bare;
        memset(timed, 0, sizeof timed);
        memset(&bare, 0, sizeof bare);
        struct workload workload;
        struct view view = {.width_px = size[0],
                            .height_px = size[1],
                            .outputs = 1u << VIEW_OUTPUT_COLOR,
                            .quality = {.shadows = SHADOWS_NONE, .samples = samples}};
        if (!count(rig, &view, &workload, err) || !time_technique(bench, rig, &view, &bare, err))
            return false;
        for (int warm = 0; warm < 2; warm++)
            bare.alone_ms[warm] =
                calibrate_alone_ms(bare.wall_ms[warm], bare.cpu_ms[warm], bench->info.is_software);
        for (int i = 0; i < TECHNIQUES; i++) {
            view.quality.shadows = techniques[i].shadows;
            if (!time_technique(bench, rig, &view, &timed[i], err))
                return false;
            for (int warm = 0; warm < 2; warm++) {
                const struct forecast_setting setting = {.samples = samples,
                                                         .shadow_resolution = 1024,
                                                         .shadow_taps = 4,
                                                         .has_shadows = true,
                                                         .is_warm = warm};
                timed[i].alone_ms[warm] =
                    calibrate_alone_ms(timed[i].wall_ms[warm], timed[i].cpu_ms[warm],
                                       techniques[i].is_on_processors || bench->info.is_software);
                timed[i].forecast_ms[warm] = technique_forecast_ms(
                    techniques[i].shadows, &(struct forecast_frame){&workload, &setting, speed});
            }
        }
        tell(bench, name, samples, &workload, timed, &bare, tally);
    }
    return true;
}

static bool open_demo(struct rig_scene *rig, struct renderer *renderer, struct error *err)
{
    void *glb = NULL;
    size_t size = 0;
    bool ok = demo_scene_build(&(struct demo_scene_desc){0}, &glb, &size, err) &&
              rig_scene_from_glb(rig, renderer, "demo", glb, size, err);
    free(glb);
    return ok;
}

/* A scene that is not there, or cannot be read, is left out. */
static bool run_all(struct bench *bench, const struct device_speed *speed, struct tally *tally,
                    struct error *err)
{
    struct renderer *renderer = bench_renderer(bench);
    int scenes = bench->options.is_quick ? 0 : ASSETS;
    for (int i = -1; i < scenes; i++) {
        struct rig_scene rig = {0};
        struct error unread = {0};
        char name[64];
        snprintf(name, sizeof name, "%s", i < 0 ? "demo" : assets[i]);
        name[strcspn(name, "/")] = 0;
        bool is_open = i < 0 ? open_demo(&rig, renderer, &unread)
                             : rig_scene_from_asset(&rig, renderer, assets[i], &unread);
        if (!is_open)
            fprintf(stderr, "%s: %s: %s\n", bench->suite, name, unread.message);
        bool ok = !is_open || !bench_wants_scene(bench, name) ||
                  run_scene(bench, name, &rig, speed, tally, err);
        rig_scene_finish(&rig, renderer);
        if (!ok)
            return error_wrap(err, "%s", name);
    }
    return true;
}

static void check(struct bench *bench, const char *subject, const char *name, double value)
{
    bench_check(bench,
                &(struct check){
                    .scene = "all", .subject = subject, .name = name, .value = value, .p = NAN});
}

/* How far from 1 the ratios are, either way. */
static void check_ratios(struct bench *bench, const char *subject, const struct samples *ratios)
{
    struct samples off = {0};
    for (size_t i = 0; i < ratios->count; i++)
        samples_add(&off, exp(fabs(log(ratios->values[i]))));
    check(bench, subject, "forecast / measured, median", samples_summary(ratios).median);
    check(bench, subject, "off by a factor of, median", samples_summary(&off).median);
    check(bench, subject, "off by a factor of, 95 %", samples_summary(&off).p95);
    samples_finish(&off);
}

bool suite_forecast(struct bench *bench, struct error *err)
{
    struct calibration calibration;
    struct tally tally = {.cases = 0};
    if (!renderer_calibrate(bench_renderer(bench), &calibration, err))
        return false;
    if (!bench->options.is_json)
        printf("  speed: shade %.2f maps %.2f trace %.2f build %.2f, frame %.2f ms\n"
               "  scene, samples              maps: forecast      rays: forecast    "
               "traced shadows, ms  taken\n",
               calibration.speed.shade, calibration.speed.maps, calibration.speed.trace,
               calibration.speed.build, calibration.speed.frame_ms);
    json_array_append_new(bench->results,
                          json_pack("{s:s,s:f,s:f}", "suite", "speed", "trace",
                                    calibration.speed.trace, "shade", calibration.speed.shade));
    bool ok = run_all(bench, &calibration.speed, &tally, err);
    for (int i = 0; i < TECHNIQUES; i++) {
        if (ok && tally.cases)
            check_ratios(bench, techniques[i].name, &tally.ratios[i]);
        samples_finish(&tally.ratios[i]);
    }
    if (ok && tally.cases) {
        check(bench, "choice", "share that took the fastest", (double)tally.right / tally.cases);
        check(bench, "choice", "time lost by the others, of all", tally.lost_ms / tally.best_ms);
    }
    return ok;
}

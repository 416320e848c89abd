/* SPDX-License-Identifier: MIT */
/* Suite `environment`: what light from all around costs: rasterised with and without a map and with
 * rays that find its shadows, ray traced by the sample, and the error of so many samples. */
#include <math.h>
#include <stdio.h>

#include "renderer/accuracy/metrics.h"
#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { FEW = 4, MANY = 16, MOST = 4096, RUNGS = 5 };
enum { WITHOUT, WITH, VISIBLE, RASTERISED };
enum { TRACED_WITHOUT, TRACED_FEW, TRACED_MANY, TRACED };

static struct view lit_view(const struct bench_scene *scene, const int size[2], int samples)
{
    struct view view = bench_scene_view(scene, size);
    view.lights = &scene->spot;
    view.light_count = 1;
    if (samples) {
        view.environment_key = VIEW_STUDIO_KEY;
        view.environment_intensity = 1;
        view.quality.environment_samples = samples;
    }
    return view;
}

static double median_cpu_ms(const struct frame_variant *variant)
{
    return samples_summary(&variant->measurement.cpu_ms).median;
}

static void state_ratio(struct bench *bench, const struct bench_scene *scene, const char *name,
                        const struct frame_variant *with, const struct frame_variant *without,
                        double bound)
{
    bench_check(bench, &(struct check){.scene = scene->name,
                                       .subject = "rasterised",
                                       .name = name,
                                       .value = median_cpu_ms(with) / median_cpu_ms(without),
                                       .relation = bound > 0 ? "<=" : NULL,
                                       .bound = bound,
                                       .p = samples_difference_p(&with->measurement.cpu_ms,
                                                                 &without->measurement.cpu_ms)});
}

static bool run_rasterised(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    int size[2];
    bench_size(bench, 1280, 720, size);
    struct frame_variant variants[RASTERISED] = {
        [WITHOUT] = {.name = "without", .view = lit_view(scene, size, 0)},
        [WITH] = {.name = "map", .view = lit_view(scene, size, MANY)},
        [VISIBLE] = {.name = "map, visibility by rays", .view = lit_view(scene, size, MANY)},
    };
    variants[VISIBLE].view.quality.environment_visibility = VIEW_VISIBILITY_RAYS;
    for (int i = 0; i < RASTERISED; i++)
        variants[i].moves_camera = true; /* else nothing would be lit anew */
    bool ok = frames_run(bench, &scene->rig, variants, RASTERISED, err);
    if (ok) {
        frames_tell(bench, scene->name, "rasterised", variants, RASTERISED);
        state_ratio(bench, scene, "cpu with / without", &variants[WITH], &variants[WITHOUT], 1.3);
        state_ratio(bench, scene, "cpu with visibility / without", &variants[VISIBLE],
                    &variants[WITHOUT], 0);
    }
    frames_finish(variants, RASTERISED);
    return ok;
}

static struct view traced_view(const struct bench_scene *scene, const int size[2], int samples)
{
    struct view view = lit_view(scene, size, samples);
    view.quality.shadows = SHADOWS_RAYTRACED;
    view.quality.samples = 1;
    return view;
}

static bool run_traced(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    int size[2];
    bench_size(bench, 320, 180, size);
    struct frame_variant variants[TRACED] = {
        [TRACED_WITHOUT] = {.name = "without", .view = traced_view(scene, size, 0)},
        [TRACED_FEW] = {.name = "4 samples", .view = traced_view(scene, size, FEW)},
        [TRACED_MANY] = {.name = "16 samples", .view = traced_view(scene, size, MANY)},
    };
    for (int i = 0; i < TRACED; i++)
        variants[i].moves_camera = true;
    bool ok = frames_run(bench, &scene->rig, variants, TRACED, err);
    if (ok) {
        double more_ms =
            median_cpu_ms(&variants[TRACED_MANY]) - median_cpu_ms(&variants[TRACED_FEW]);
        frames_tell(bench, scene->name, "ray traced", variants, TRACED);
        bench_check(bench, &(struct check){.scene = scene->name,
                                           .subject = "ray traced",
                                           .name = "cpu ns per pixel and sample",
                                           .value = 1e6 * more_ms / (MANY - FEW) /
                                                    ((double)size[0] * size[1]),
                                           .p = NAN});
    }
    frames_finish(variants, TRACED);
    return ok;
}

/* RMSE of a picture with so many samples against one with MOST. */
static bool find_error(struct bench *bench, const struct bench_scene *scene, const int size[2],
                       int samples, struct image *reference, double *rmse, struct error *err)
{
    struct frame frame;
    struct image_metrics metrics;
    struct view view = traced_view(scene, size, samples);
    bool ok = renderer_render(bench_renderer(bench), scene->rig.key, &view, &frame, err);
    struct image_metrics_desc desc = {
        .image = &frame.outputs[VIEW_OUTPUT_COLOR], .reference = reference, .channels = 7};
    ok = ok && image_metrics_measure(&desc, &metrics, err);
    *rmse = ok ? metrics.overall.rmse : NAN;
    frame_finish(&frame);
    return ok;
}

static bool run_errors(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    const bool is_quick = bench->options.is_quick;
    double counts[RUNGS], errors[RUNGS];
    struct frame reference;
    int size[2], rungs = is_quick ? 2 : RUNGS;
    bench_size(bench, 160, 90, size);
    struct view view = traced_view(scene, size, is_quick ? 256 : MOST);
    bool ok = renderer_render(bench_renderer(bench), scene->rig.key, &view, &reference, err);
    for (int i = 0; ok && i < rungs; i++) {
        counts[i] = 1 << 2 * i;
        ok = find_error(bench, scene, size, 1 << 2 * i, &reference.outputs[VIEW_OUTPUT_COLOR],
                        &errors[i], err);
    }
    if (ok)
        bench_series(bench, &(struct series){.scene = scene->name,
                                             .subject = "ray traced",
                                             .name = "RMSE",
                                             .of = "environment samples",
                                             .unit = "of white",
                                             .x = counts,
                                             .y = errors,
                                             .count = rungs,
                                             .growth = GROWTH_ANY});
    frame_finish(&reference);
    return ok;
}

static bool run_scene(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    return run_rasterised(bench, scene, err) && run_traced(bench, scene, err) &&
           run_errors(bench, scene, err);
}

bool suite_environment(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_scene, err);
}

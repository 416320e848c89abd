/* SPDX-License-Identifier: MIT */
/* Suite `smoke`: what media in the air cost, and their error. Haze in the scene's own lights:
 * frames with and without it by each technique, by their passes, and RMSEs against the reference.
 */
#include <math.h>
#include <stdio.h>

#include "renderer/accuracy/metrics.h"
#include "tests/bench/chapel_haze.h"
#include "tests/bench/close_up.h"
#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { WITHOUT, WITH, FEW, VARIANTS };
enum { RUNGS = 4 };
static const double HAZE_MOST = 2; /* of the frame without it */

static const enum shadow_technique techniques[] = {SHADOWS_DEEP, SHADOWS_RAYTRACED,
                                                   SHADOWS_RAYTRACED_SHADOWS};

static struct view smoke_view(const struct bench_scene *scene, const int size[2],
                              enum shadow_technique shadows, int haze_samples)
{
    struct view view = bench_scene_view(scene, size);
    view.ignore_scene_lights = false;
    view.quality.samples = 4; /* as requests have it */
    view.quality.shadows = shadows;
    if (haze_samples) {
        view.atmosphere =
            (struct view_atmosphere){.density_per_m = 0.06, .color = {1, 1, 1}, .anisotropy = 0.5};
        view.quality.atmosphere_samples = haze_samples;
    }
    return view;
}

static double median_cpu_ms(const struct frame_variant *variant)
{
    return samples_summary(&variant->measurement.cpu_ms).median;
}

static void state(struct bench *bench, const struct bench_scene *scene, const char *subject,
                  const struct frame_variant variants[VARIANTS])
{
    frames_tell(bench, scene->name, subject, variants, VARIANTS);
    for (int i = 0; i < VARIANTS; i++)
        frames_print_split(bench, &variants[i]);
    for (int i = WITH; i < VARIANTS; i++) {
        char name[64];
        snprintf(name, sizeof name, "cpu %s / without", variants[i].name);
        bench_check(bench,
                    &(struct check){
                        .scene = scene->name,
                        .subject = subject,
                        .name = name,
                        .value = median_cpu_ms(&variants[i]) / median_cpu_ms(&variants[WITHOUT]),
                        .relation = i == WITH ? "<=" : NULL,
                        .bound = HAZE_MOST,
                        .p = samples_difference_p(&variants[i].measurement.cpu_ms,
                                                  &variants[WITHOUT].measurement.cpu_ms)});
    }
}

static bool run_frames(struct bench *bench, const struct bench_scene *scene,
                       enum shadow_technique shadows, struct error *err)
{
    int size[2];
    bench_size(bench, 640, 360, size);
    struct frame_variant variants[VARIANTS] = {
        [WITHOUT] = {.name = "without", .view = smoke_view(scene, size, shadows, 0)},
        [WITH] = {.name = "haze", .view = smoke_view(scene, size, shadows, 64)},
        [FEW] = {.name = "haze, 16 slices", .view = smoke_view(scene, size, shadows, 16)},
    };
    for (int i = 0; i < VARIANTS; i++)
        variants[i].moves_camera = true; /* else surfaces would stand */
    bool ok = frames_run(bench, &scene->rig, variants, VARIANTS, err);
    if (ok)
        state(bench, scene, shadow_technique_name((int)shadows), variants);
    frames_finish(variants, VARIANTS);
    return ok;
}

/* Mean absolute error of a picture against the reference, over its mean. */
static bool find_error(struct bench *bench, const struct bench_scene *scene,
                       const struct view *view, struct image *reference, double *error,
                       struct error *err)
{
    struct frame frame;
    struct image_metrics metrics;
    bool ok = renderer_render(bench_renderer(bench), scene->rig.key, view, &frame, err);
    struct image_metrics_desc desc = {
        .image = &frame.outputs[VIEW_OUTPUT_COLOR], .reference = reference, .channels = 7};
    ok = ok && image_metrics_measure(&desc, &metrics, err);
    *error = ok ? metrics.overall.mae / metrics.overall.mean_reference : NAN;
    frame_finish(&frame);
    return ok;
}

/* Pictures without haze, and of it with 16, 64 and 256 samples, each against its reference: a
 * highlight of one pixel rules the RMSE of both, so that the mean error tells more. */
static bool run_errors(struct bench *bench, const struct bench_scene *scene,
                       struct frame references[2], struct error *err)
{
    static const int counts[RUNGS] = {0, 16, 64, 256};
    int size[2];
    bench_size(bench, 320, 180, size);
    if (bench->options.is_quick)
        size[0] = size[0] < 24 ? size[0] : 24, size[1] = size[1] < 14 ? size[1] : 14;
    for (int hazy = 0; hazy < 2; hazy++) {
        struct view view = smoke_view(scene, size, SHADOWS_RAYTRACED, 32 * hazy);
        view.quality.reference = true;
        if (!renderer_render(bench_renderer(bench), scene->rig.key, &view, &references[hazy], err))
            return false;
    }
    for (size_t t = 0; t < sizeof techniques / sizeof *techniques; t++)
        for (int i = 0; i < RUNGS; i++) {
            struct view view = smoke_view(scene, size, techniques[t], counts[i]);
            struct image *reference = &references[counts[i] > 0].outputs[VIEW_OUTPUT_COLOR];
            char name[64];
            double error;
            if (!find_error(bench, scene, &view, reference, &error, err))
                return false;
            snprintf(name, sizeof name, "mean error, %d atmosphere samples", counts[i]);
            bench_check(bench, &(struct check){.scene = scene->name,
                                               .subject = shadow_technique_name((int)techniques[t]),
                                               .name = i ? name : "mean error without haze",
                                               .value = error,
                                               .p = NAN});
        }
    return true;
}

static bool run_scene(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    bool ok = true;
    for (size_t t = 0; ok && t < sizeof techniques / sizeof *techniques; t++)
        ok = run_frames(bench, scene, techniques[t], err);
    struct frame references[2] = {0};
    ok = ok && run_errors(bench, scene, references, err);
    for (int i = 0; i < 2; i++)
        frame_finish(&references[i]);
    return ok;
}

bool suite_smoke(struct bench *bench, struct error *err)
{
    return (!bench_wants_scene(bench, "close-up") || close_up_run(bench, err)) &&
           (!bench_wants_scene(bench, "chapel") || chapel_haze_run(bench, err)) &&
           bench_scenes_run(bench, run_scene, err);
}

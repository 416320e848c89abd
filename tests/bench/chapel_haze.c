/* SPDX-License-Identifier: MIT */
/* Frames with and without haze in turn, and pictures of few slices beside one of many. */
#include "tests/bench/chapel_haze.h"

#include <math.h>

#include "protocol/quality_defaults.h"
#include "renderer/accuracy/metrics.h"
#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { WITHOUT, WITH, VARIANTS };
static const double HAZE_MOST = 2; /* of the frame without it */
static const double RMSE_MOST = 0.01;

/* The bench's own camera is first, then those that no setting was chosen by, and haze that scatters
 * alike in all directions, which shows less of the lamps in view. */
static const struct stand {
    const char *name;
    float anisotropy;
    double eye[3], target[3], fov_y_deg; /* 0: of the bench's scene */
} stands[] = {
    {.name = "nave", .anisotropy = 0.5f},
    {"rose window", 0.5f, {0.6, 2.2, 1}, {0, 5.6, -9.9}, 50},
    {"vessel", 0.5f, {2.75, 1.75, 3.75}, {1.5, 1.2, 2.2}, 36},
    {"aisle", 0.5f, {-3.2, 1.6, -6}, {2, 2.4, 4}, 60},
    {.name = "nave, alike", .anisotropy = 0},
};

static struct view look(const struct bench_scene *scene, const struct stand *stand,
                        const int size[2], int slices)
{
    struct view view = bench_scene_view(scene, size);
    view.ignore_scene_lights = false;
    view.quality.samples = SAMPLES_DEFAULT;
    view.quality.shadows = SHADOWS_DEEP;
    if (stand->fov_y_deg > 0) {
        for (int k = 0; k < 3; k++) {
            view.camera.eye[k] = stand->eye[k];
            view.camera.target[k] = stand->target[k];
        }
        view.camera.fov_y_deg = stand->fov_y_deg;
    }
    if (slices) {
        view.atmosphere = (struct view_atmosphere){
            .density_per_m = 0.06, .color = {1, 1, 1}, .anisotropy = stand->anisotropy};
        view.quality.atmosphere_samples = slices;
    }
    return view;
}

static bool time_frames(struct bench *bench, const struct bench_scene *scene,
                        const struct stand *stand, const int size[2], struct error *err)
{
    struct frame_variant variants[VARIANTS] = {
        [WITHOUT] = {.name = "without", .view = look(scene, stand, size, 0), .moves_camera = true},
        [WITH] = {.name = "haze",
                  .view = look(scene, stand, size, ATMOSPHERE_SLICES_DEFAULT),
                  .moves_camera = true}};
    const struct samples *with = &variants[WITH].measurement.cpu_ms,
                         *without = &variants[WITHOUT].measurement.cpu_ms;
    bool ok = frames_run(bench, &scene->rig, variants, VARIANTS, err);
    if (ok) {
        frames_tell(bench, "chapel", stand->name, variants, VARIANTS);
        frames_print_split(bench, &variants[WITHOUT]);
        frames_print_split(bench, &variants[WITH]);
        bench_check(bench, &(struct check){.scene = "chapel",
                                           .subject = stand->name,
                                           .name = "cpu haze / without",
                                           .value = samples_summary(with).median /
                                                    samples_summary(without).median,
                                           .relation = "<=",
                                           .bound = HAZE_MOST,
                                           .p = samples_difference_p(with, without)});
    }
    frames_finish(variants, VARIANTS);
    return ok;
}

/* The surfaces of both pictures are the same. */
static bool compare(struct bench *bench, const struct bench_scene *scene, const struct stand *stand,
                    const int size[2], struct error *err)
{
    struct frame frames[2] = {0};
    struct image_metrics metrics;
    static const int slices[2] = {ATMOSPHERE_SLICES_DEFAULT, ATMOSPHERE_SLICES_MORE};
    bool ok = true;
    for (int i = 0; ok && i < 2; i++) {
        const struct view view = look(scene, stand, size, slices[i]);
        ok = renderer_render(bench_renderer(bench), scene->rig.key, &view, &frames[i], err);
    }
    ok = ok && image_metrics_measure(
                   &(struct image_metrics_desc){.image = &frames[0].outputs[VIEW_OUTPUT_COLOR],
                                                .reference = &frames[1].outputs[VIEW_OUTPUT_COLOR],
                                                .channels = 7},
                   &metrics, err);
    if (ok)
        bench_check(bench, &(struct check){.scene = "chapel",
                                           .subject = stand->name,
                                           .name = "RMSE beside 256 slices",
                                           .value = metrics.overall.rmse,
                                           .relation = "<=",
                                           .bound = RMSE_MOST,
                                           .p = NAN});
    for (int i = 0; i < 2; i++)
        frame_finish(&frames[i]);
    return ok;
}

bool chapel_haze_run(struct bench *bench, struct error *err)
{
    struct bench_scene scene;
    int size[2];
    bench_size(bench, 640, 360, size);
    size_t count = bench->options.is_quick ? 1 : sizeof stands / sizeof *stands;
    bool ok = bench_demo_open(&scene, bench_renderer(bench), err);
    for (size_t i = 0; ok && i < count; i++)
        ok = compare(bench, &scene, &stands[i], size, err) &&
             time_frames(bench, &scene, &stands[i], size, err);
    bench_scene_close(&scene, bench_renderer(bench));
    return ok;
}

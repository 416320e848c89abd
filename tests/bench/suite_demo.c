/* SPDX-License-Identifier: MIT */
/* Suite `demo`: what a user of the demo scene waits for. The first frame with cold programs, the
 * first shadows, warm frames by antialiasing and taps with the split by pass, a moving camera. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { WARM = 4, VARIANTS = WARM + 3 };

static const char *const cold_names[] = {"first frame, cold", "second frame",
                                         "third frame, lights moved"};

/* Frames that happen once: of a renderer just opened. */
static bool run_cold(struct bench *bench, const struct bench_scene *scene, const struct view *view,
                     struct error *err)
{
    for (int i = 0; i < 3; i++) {
        struct measurement m = {0};
        struct frame_times times;
        if (!frame_measure(bench_renderer(bench), &scene->rig, view, i == 2, &times, &m.report,
                           err))
            return false;
        measurement_add(&m, &times);
        bench_result(bench, &(struct result){.scene = scene->name,
                                             .subject = "once, 4 samples",
                                             .variant = cold_names[i],
                                             .width = view->width_px,
                                             .height = view->height_px,
                                             .stage = PART_SHADOW,
                                             .measurement = &m});
        measurement_finish(&m);
    }
    return true;
}

static void check_reuse(struct bench *bench, const struct bench_scene *scene,
                        const struct frame_variant *moving, const struct frame_variant *still)
{
    struct check check = {.scene = scene->name,
                          .subject = "camera moves",
                          .name = "shadow structures rebuilt",
                          .value = (double)moving->measurement.report.counts.shadow_maps_built,
                          .relation = "<=",
                          .p = NAN};
    bench_check(bench, &check);
    check.name = "frame cpu moving / still";
    check.value = samples_summary(&moving->measurement.cpu_ms).median /
                  samples_summary(&still->measurement.cpu_ms).median;
    check.relation = NULL;
    check.p = samples_difference_p(&moving->measurement.cpu_ms, &still->measurement.cpu_ms);
    bench_check(bench, &check);
}

static uint64_t shadow_bytes(const struct frame_report *report)
{
    for (int i = 0; i < report->byte_count; i++)
        if (!strcmp(report->bytes[i].structure, "shadows")) /* all of the shadow system */
            return report->bytes[i].bytes;
    return 0;
}

static bool run_warm(struct bench *bench, const struct bench_scene *scene, const struct view *view,
                     struct error *err)
{
    struct frame_variant v[VARIANTS] = {
        {.name = "1 sample, 1 tap"},
        {.name = "1 sample, 4 taps"},
        {.name = "4 samples, 1 tap"},
        {.name = "4 samples, 4 taps"},
        {.name = "4x4, camera moves", .moves_camera = true},
        {.name = "4x4, no shadows"},
        {.name = "4x4, shadows rebuilt", .rebuilds_shadows = true},
    };
    for (int i = 0; i < VARIANTS; i++) {
        v[i].view = *view;
        v[i].view.quality.samples = i < 2 ? 1 : 4;
        v[i].view.quality.shadow_taps = i < WARM && i % 2 == 0 ? 1 : 4;
    }
    v[WARM + 1].view.quality.shadows = SHADOWS_NONE;
    bool ok = frames_run(bench, &scene->rig, v, VARIANTS, err);
    for (int i = 0; ok && i < VARIANTS; i++)
        bench_result(bench,
                     &(struct result){.scene = scene->name,
                                      .subject = "warm, 12 lights",
                                      .variant = v[i].name,
                                      .width = view->width_px,
                                      .height = view->height_px,
                                      .stage = PART_SHADOW,
                                      .structure_bytes = shadow_bytes(&v[i].measurement.report),
                                      .measurement = &v[i].measurement});
    for (int i = 0; ok && i < VARIANTS; i++)
        frames_print_split(bench, &v[i]);
    if (ok)
        check_reuse(bench, scene, &v[WARM], &v[WARM - 1]);
    frames_finish(v, VARIANTS);
    return ok;
}

bool suite_demo(struct bench *bench, struct error *err)
{
    struct bench_scene scene;
    int size[2];
    bench_size(bench, 1280, 720, size);
    if (!bench_wants_scene(bench, "demo"))
        return true;
    if (!bench_demo_open(&scene, bench_renderer(bench), err))
        return false;
    struct view view = bench_scene_view(&scene, size);
    view.ignore_scene_lights = false;
    view.quality.samples = 4;
    bool ok = run_cold(bench, &scene, &view, err) && run_warm(bench, &scene, &view, err);
    bench_scene_close(&scene, bench_renderer(bench));
    return ok;
}

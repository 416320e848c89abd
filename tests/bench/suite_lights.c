/* SPDX-License-Identifier: MIT */
/* Suites `lights` and `linear`: many cone lights without shadows (Lindbeck 2015, figure 3.11), and
 * how frame time grows with their number. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { LIST_VARIANTS = 3 };

/* How many lists there are: the product in "50 lights of the scene in 32x24x24 clusters". */
static double list_count(const struct frame_report *report)
{
    for (int i = 0; i < report->pass_count; i++) {
        double lists = 1, side = 0;
        const char *text = strcmp(report->passes[i].pass, "light_list")
                               ? NULL
                               : strstr(report->passes[i].because, " in ");
        if (!text)
            continue;
        text += 4;
        for (char *end; side = strtod(text, &end), end != text; text = end + (*end == 'x'))
            lists *= side;
        return lists;
    }
    return 0;
}

/* What the lists hold: an entry of a cluster is a light's number, an element of a linked list has
 * 16 bytes; a cluster's head has two words, a linked list's one. The buffers behind them keep the
 * size of the largest frame and are in the report's bytes. */
static uint64_t list_bytes(const struct frame_report *report, bool is_linked)
{
    uint64_t entries = report->counts.light_list_entries, lists = (uint64_t)list_count(report);
    return is_linked ? 16 * entries + 4 * lists : 4 * entries + 8 * lists;
}

static void report_lists(struct bench *bench, const struct bench_scene *scene, const char *subject,
                         const struct frame_variant *variant)
{
    const struct frame_report *report = &variant->measurement.report;
    bool is_linked = variant->view.quality.light_lists == VIEW_LIGHT_LISTS_LINKED;
    double lists = list_count(report);
    bench_result(bench, &(struct result){
                            .scene = scene->name,
                            .subject = subject,
                            .variant = variant->name,
                            .width = variant->view.width_px,
                            .height = variant->view.height_px,
                            .stage = PART_LIGHT_LIST,
                            .mean_light_list =
                                lists > 0 ? (double)report->counts.light_list_entries / lists : 0,
                            .structure_bytes = list_bytes(report, is_linked),
                            .measurement = &variant->measurement,
                        });
}

static double stage_cpu(const struct frame_variant *variant, const char *part)
{
    const struct part_series *series = measurement_part(&variant->measurement, part);
    return series ? samples_summary(&series->cpu_ms).median : NAN;
}

static void compare(struct bench *bench, const struct bench_scene *scene, const char *subject,
                    const struct frame_variant *ours, const struct frame_variant *other)
{
    char name[96];
    struct check check = {.scene = scene->name, .subject = subject, .name = name};
    snprintf(name, sizeof name, "frame cpu %s / %s", ours->name, other->name);
    check.value = samples_summary(&ours->measurement.cpu_ms).median /
                  samples_summary(&other->measurement.cpu_ms).median;
    check.p = samples_difference_p(&ours->measurement.cpu_ms, &other->measurement.cpu_ms);
    bench_check(bench, &check);
    snprintf(name, sizeof name, "list cpu %s / %s", ours->name, other->name);
    check.value = stage_cpu(ours, PART_LIGHT_LIST) / stage_cpu(other, PART_LIGHT_LIST);
    check.p = NAN;
    bench_check(bench, &check);
}

static bool run_count(struct bench *bench, const struct bench_scene *scene, int count,
                      double frame_cpu_ms[LIST_VARIANTS], struct error *err)
{
    static const struct {
        const char *name;
        enum view_light_lists technique;
        bool faithful;
    } kinds[LIST_VARIANTS] = {{"clustered", VIEW_LIGHT_LISTS_CLUSTERED, false},
                              {"linked", VIEW_LIGHT_LISTS_LINKED, false},
                              {"linked-faithful", VIEW_LIGHT_LISTS_LINKED, true}};
    static struct view_light lights[BENCH_LIGHTS_MAX];
    struct frame_variant variants[LIST_VARIANTS] = {0};
    char subject[32];
    int size[2];
    bench_size(bench, 1024, 768, size);
    snprintf(subject, sizeof subject, "%d cone lights", count);
    bench_scene_cones(scene, lights, count);
    for (int i = 0; i < LIST_VARIANTS; i++) {
        struct frame_variant *v = &variants[i];
        v->name = kinds[i].name;
        v->view = bench_scene_view(scene, size);
        v->view.lights = lights;
        v->view.light_count = (size_t)count;
        v->view.quality.shadows = SHADOWS_NONE;
        v->view.quality.light_lists = kinds[i].technique;
        v->view.quality.faithful = kinds[i].faithful;
    }
    bool ok = frames_run(bench, &scene->rig, variants, LIST_VARIANTS, err);
    for (int i = 0; ok && i < LIST_VARIANTS; i++) {
        report_lists(bench, scene, subject, &variants[i]);
        frame_cpu_ms[i] = samples_summary(&variants[i].measurement.cpu_ms).median;
    }
    if (ok) {
        compare(bench, scene, subject, &variants[0], &variants[1]);
        compare(bench, scene, subject, &variants[0], &variants[2]);
    }
    frames_finish(variants, LIST_VARIANTS);
    return ok;
}

static bool run_counts(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    double counts[5], cpu[LIST_VARIANTS][5];
    int cases = bench->options.is_quick ? 1 : 5;
    for (int i = 0; i < cases; i++) {
        double frame_cpu_ms[LIST_VARIANTS];
        counts[i] = 50 * (i + 1);
        if (!run_count(bench, scene, 50 * (i + 1), frame_cpu_ms, err))
            return false;
        for (int k = 0; k < LIST_VARIANTS; k++)
            cpu[k][i] = frame_cpu_ms[k];
    }
    for (int k = 0; cases > 2 && k < LIST_VARIANTS; k++) {
        static const char *const names[LIST_VARIANTS] = {
            "R2 of a line, clustered", "R2 of a line, linked", "R2 of a line, linked-faithful"};
        bench_check(bench, &(struct check){.scene = scene->name,
                                           .subject = "50 to 250 lights",
                                           .name = names[k],
                                           .value = fit_line_r2(counts, cpu[k], 5),
                                           .p = NAN});
    }
    return true;
}

bool suite_lights(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_counts, err);
}

/* -- linear -- */

/* Of the lists, of the frame, and of what the lights add to a frame with one light out of view: the
 * last hides nothing behind the cost of the picture itself. */
static void report_growth(struct bench *bench, const struct bench_scene *scene,
                          const double counts[], const double cpu[], const double lists[],
                          int steps)
{
    double added[SERIES_MAX];
    for (int i = 1; i < steps; i++)
        added[i] = cpu[i] - cpu[0];
    const struct {
        const char *name;
        const double *y;
    } kinds[] = {{"light list cpu", lists}, {"frame cpu", cpu}, {"cpu that lights add", added}};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        bench_series(bench, &(struct series){.scene = scene->name,
                                             .subject = "lights",
                                             .name = kinds[k].name,
                                             .of = "cone lights",
                                             .unit = "ms",
                                             .x = counts + 1,
                                             .y = kinds[k].y + 1,
                                             .count = steps - 1,
                                             .growth = GROWTH_LINEAR});
}

/* The first of the numbers is that of lights out of view. */
static bool run_numbers(struct bench *bench, const struct bench_scene *scene,
                        const int numbers[SERIES_MAX], struct error *err)
{
    static struct view_light lights[BENCH_LIGHTS_MAX];
    int steps = bench->options.is_quick ? 4 : SERIES_MAX, size[2];
    struct frame_variant variants[SERIES_MAX] = {0};
    double counts[SERIES_MAX], cpu[SERIES_MAX], lists[SERIES_MAX];
    bench_size(bench, 1024, 768, size);
    bench_scene_cones(scene, lights, BENCH_LIGHTS_MAX);
    struct view_light out_of_view = lights[0];
    out_of_view.position[1] = -1e4;
    for (int i = 0; i < steps; i++) {
        variants[i].name = "clustered";
        variants[i].view = bench_scene_view(scene, size);
        variants[i].view.lights = i ? lights : &out_of_view;
        variants[i].view.light_count = (size_t)numbers[i];
        variants[i].view.quality.shadows = SHADOWS_NONE;
    }
    bool ok = frames_run(bench, &scene->rig, variants, (size_t)steps, err);
    for (int i = 0; ok && i < steps; i++) {
        char subject[32];
        snprintf(subject, sizeof subject, i ? "%d cone lights" : "%d out of view", numbers[i]);
        report_lists(bench, scene, subject, &variants[i]);
        counts[i] = numbers[i];
        cpu[i] = samples_summary(&variants[i].measurement.cpu_ms).median;
        lists[i] = stage_cpu(&variants[i], PART_LIGHT_LIST);
    }
    if (ok)
        report_growth(bench, scene, counts, cpu, lists, steps);
    frames_finish(variants, (size_t)steps);
    return ok;
}

static bool run_growth(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    static const int numbers[SERIES_MAX] = {1, 16, 32, 64, 128, 256, 512, 1024};
    return run_numbers(bench, scene, numbers, err);
}

static bool run_scaling(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    static const int numbers[SERIES_MAX] = {1, 1, 4, 16, 64, 256, 1024, BENCH_LIGHTS_MAX};
    return run_numbers(bench, scene, numbers, err);
}

bool suite_linear(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_growth, err);
}

bool scale_lights(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_scaling, err);
}

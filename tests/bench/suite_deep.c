/* SPDX-License-Identifier: MIT */
/* Suites `deep` and `both`: deep shadow maps of one spot light by resolution, and of many at one
 * (Lindbeck 2015, figures 3.13 and 3.15), in the default and the linked forms. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/shadows/shadow_deep.h"
#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { FORMS = 3, CASE_LIGHTS_MAX = 32 };

static const struct form {
    const char *name, *still;
    enum shadow_technique shadows;
    bool faithful;
} forms[FORMS] = {
    {"deep", "deep, static", SHADOWS_DEEP, false},
    {"deep-linked", "deep-linked, static", SHADOWS_DEEP_LINKED, false},
    {"linked-faithful", "linked-faithful, static", SHADOWS_DEEP_LINKED, true},
};

/* What one frame's maps take: 16 bytes an event (deep: two more for its key), and per texel a
 * head and, in the forms that cull behind opaque casters, an opaque depth. The pools of the store
 * hold the maps of all variants. */
static uint64_t map_bytes(const struct frame_report *report, int resolution,
                          enum shadow_technique technique, bool faithful)
{
    uint64_t texels = (uint64_t)resolution * (uint64_t)resolution * report->counts.shadowed_lights;
    uint64_t event_bytes = technique == SHADOWS_DEEP ? SHADOW_EVENT_BYTES : 16;
    return report->counts.events * event_bytes + texels * (faithful ? 4 : 8);
}

static struct summary stage_summary(const struct frame_variant *variant, const char *part)
{
    static const struct samples none;
    const struct part_series *series = measurement_part(&variant->measurement, part);
    return samples_summary(series ? &series->cpu_ms : &none);
}

/* The walk over finished linked lists only counts them for the report. */
static double build_cpu(const struct frame_variant *variant)
{
    double walk = stage_summary(variant, "shadow.linked.walk").median;
    return stage_summary(variant, PART_SHADOW).median - (isfinite(walk) ? walk : 0);
}

static void check_ratios(struct bench *bench, const char *scene, const char *subject,
                         const struct frame_variant *variants)
{
    for (int i = 1; i < FORMS; i++) {
        char name[96];
        struct check check = {.scene = scene, .subject = subject, .name = name};
        snprintf(name, sizeof name, "build cpu deep / %s (no walk)", forms[i].name);
        check.value = build_cpu(&variants[0]) / build_cpu(&variants[i]);
        check.p = NAN;
        bench_check(bench, &check);
        snprintf(name, sizeof name, "static frame cpu deep / %s", forms[i].name);
        const struct samples *ours = &variants[FORMS].measurement.cpu_ms;
        const struct samples *other = &variants[FORMS + i].measurement.cpu_ms;
        check.value = samples_summary(ours).median / samples_summary(other).median;
        check.p = samples_difference_p(ours, other);
        bench_check(bench, &check);
    }
}

struct shadow_case {
    const char *subject;
    const struct view_light *lights;
    int light_count, resolution;
};

/* Three forms rebuilding, then three reusing. build_ms: of the rebuilding ones. */
static bool run_case(struct bench *bench, const struct bench_scene *scene,
                     const struct shadow_case *c, double build_ms[FORMS], struct error *err)
{
    struct frame_variant variants[2 * FORMS] = {0};
    int size[2];
    bench_size(bench, 1024, 768, size);
    for (int i = 0; i < 2 * FORMS; i++) {
        struct frame_variant *v = &variants[i];
        v->name = i < FORMS ? forms[i].name : forms[i - FORMS].still;
        v->rebuilds_shadows = i < FORMS;
        v->view = bench_scene_view(scene, size);
        v->view.lights = c->lights;
        v->view.light_count = (size_t)c->light_count;
        v->view.quality.shadows = forms[i % FORMS].shadows;
        v->view.quality.faithful = forms[i % FORMS].faithful;
        v->view.quality.shadow_resolution = c->resolution;
        v->view.quality.shadow_taps = 1;
    }
    /* forgetting drops the maps of every form: each reuses what the frame before it has built */
    struct frame_variant ordered[2 * FORMS];
    for (int i = 0; i < 2 * FORMS; i++)
        ordered[i] = variants[i / 2 + i % 2 * FORMS];
    bool ok = frames_run(bench, &scene->rig, ordered, 2 * FORMS, err);
    for (int i = 0; i < 2 * FORMS; i++)
        variants[i / 2 + i % 2 * FORMS] = ordered[i];
    if (ok && !variants[0].measurement.report.counts.events)
        ok = error_set(err, ERROR_INTERNAL, "%s: no light meets a curtain", c->subject);
    for (int i = 0; ok && i < 2 * FORMS; i++)
        bench_result(bench, &(struct result){
                                .scene = scene->name,
                                .subject = c->subject,
                                .variant = variants[i].name,
                                .width = size[0],
                                .height = size[1],
                                .stage = PART_SHADOW,
                                .structure_bytes =
                                    map_bytes(&variants[i].measurement.report, c->resolution,
                                              forms[i % FORMS].shadows, forms[i % FORMS].faithful),
                                .measurement = &variants[i].measurement,
                            });
    if (ok)
        check_ratios(bench, scene->name, c->subject, variants);
    for (int i = 0; ok && i < FORMS; i++)
        build_ms[i] = build_cpu(&variants[i]);
    frames_finish(variants, 2 * FORMS);
    return ok;
}

static void report_sides(struct bench *bench, const struct bench_scene *scene, const double sides[],
                         double build[FORMS][SERIES_MAX], int count)
{
    for (int i = 0; i < FORMS; i++) {
        char name[64];
        snprintf(name, sizeof name, "build cpu, %s", forms[i].name);
        bench_series(bench, &(struct series){.scene = scene->name,
                                             .subject = "map side",
                                             .name = name,
                                             .of = "texels per side",
                                             .unit = "ms",
                                             .x = sides,
                                             .y = build[i],
                                             .count = count,
                                             .growth = GROWTH_SQUARE});
    }
}

/* Figure 3.13 grows by less than 4 per doubling of the side. Maps that the budget has no room for
 * end the series. */
static bool run_sides(struct bench *bench, const struct bench_scene *scene, int last,
                      struct error *err)
{
    double before[FORMS] = {NAN, NAN, NAN}, sides[SERIES_MAX], build[FORMS][SERIES_MAX];
    int count = 0;
    for (int resolution = 256; resolution <= last; resolution *= 2) {
        char subject[32];
        double build_ms[FORMS];
        snprintf(subject, sizeof subject, "1 spot, %d^2", resolution);
        struct shadow_case c = {subject, &scene->spot, 1, resolution};
        if (!run_case(bench, scene, &c, build_ms, err)) {
            if (!count || err->code != ERROR_OVER_BUDGET)
                return false;
            fprintf(stderr, "%s: %s left out: %s\n", bench->suite, subject, err->message);
            *err = (struct error){0};
            break;
        }
        for (int i = 0; i < FORMS; i++) {
            char name[96];
            snprintf(name, sizeof name, "build cpu, twice the side, %s", forms[i].name);
            struct check check = {.scene = scene->name,
                                  .subject = subject,
                                  .name = name,
                                  .value = build_ms[i] / before[i],
                                  .p = NAN};
            if (resolution > 256)
                bench_check(bench, &check);
            before[i] = build[i][count] = build_ms[i];
        }
        sides[count++] = resolution;
    }
    report_sides(bench, scene, sides, build, count);
    return true;
}

static bool run_figure(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    return run_sides(bench, scene, bench->options.is_quick ? 256 : 2048, err);
}

static bool run_scaling(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    return run_sides(bench, scene, bench->options.is_quick ? 512 : 4096, err);
}

static bool run_counts(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    int last = bench->options.is_quick ? 5 : 25;
    double counts[5], build[FORMS][5];
    int cases = 0;
    for (int count = 5; count <= last; count += 5) {
        struct view_light lights[CASE_LIGHTS_MAX];
        char subject[32];
        double build_ms[FORMS];
        bench_scene_spots(scene, lights, count);
        snprintf(subject, sizeof subject, "%d spots, 512^2", count);
        struct shadow_case c = {subject, lights, count, 512};
        if (!run_case(bench, scene, &c, build_ms, err))
            return false;
        for (int i = 0; i < FORMS; i++)
            build[i][cases] = build_ms[i];
        counts[cases++] = count;
    }
    for (int i = 0; cases > 2 && i < FORMS; i++) {
        char name[96];
        snprintf(name, sizeof name, "exponent of build cpu time, %s", forms[i].name);
        bench_check(bench, &(struct check){.scene = scene->name,
                                           .subject = "5 to 25 spots",
                                           .name = name,
                                           .value = fit_exponent(counts, build[i], (size_t)cases),
                                           .p = NAN});
    }
    return true;
}

bool suite_deep(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_figure, err);
}

bool scale_maps(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_scaling, err);
}

bool suite_both(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_counts, err);
}

/* SPDX-License-Identifier: MIT */
/* Suite `targets`: what lights and shadows may cost beside each other, each with its bound. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { SPOTS = 25, STEPS = 5, MATERIALS_MAX = 256, ROUNDS_MAX = 32 };

static const double MOVING_SECONDS = 40; /* five rounds differ by 10 %: not enough */

static double frame_cpu(const struct frame_variant *variant)
{
    return samples_summary(&variant->measurement.cpu_ms).median;
}

static double build_cpu(const struct frame_variant *variant)
{
    const struct part_series *series = measurement_part(&variant->measurement, PART_SHADOW);
    return series ? samples_summary(&series->cpu_ms).median : NAN;
}

struct target {
    const char *subject, *name;
    double value, bound; /* bound 0: the value is told, no more */
};

static void tell(struct bench *bench, const struct bench_scene *scene, const struct target *target)
{
    bench_check(bench, &(struct check){.scene = scene->name,
                                       .subject = target->subject,
                                       .name = target->name,
                                       .value = target->value,
                                       .relation = target->bound > 0 ? "<=" : NULL,
                                       .bound = target->bound,
                                       .p = NAN});
}

static struct frame_variant variant_of(const struct bench *bench, const struct bench_scene *scene,
                                       const char *name, const struct view_light *lights,
                                       size_t count)
{
    int size[2];
    struct frame_variant variant = {.name = name};
    bench_size(bench, 1024, 768, size);
    variant.view = bench_scene_view(scene, size);
    variant.view.lights = lights;
    variant.view.light_count = count;
    variant.view.quality.shadows = SHADOWS_NONE;
    return variant;
}

static void report(struct bench *bench, const struct bench_scene *scene, const char *subject,
                   const struct frame_variant *variants, size_t count)
{
    for (size_t i = 0; i < count; i++)
        bench_result(bench, &(struct result){.scene = scene->name,
                                             .subject = subject,
                                             .variant = variants[i].name,
                                             .width = variants[i].view.width_px,
                                             .height = variants[i].view.height_px,
                                             .stage = PART_SHADOW,
                                             .measurement = &variants[i].measurement});
}

/* 250 lights without shadow beside ten. */
static bool run_many(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    static struct view_light few[10], many[250];
    bench_scene_cones(scene, few, 10);
    bench_scene_cones(scene, many, 250);
    struct frame_variant variants[] = {variant_of(bench, scene, "10", few, 10),
                                       variant_of(bench, scene, "250", many, 250)};
    bool ok = frames_run(bench, &scene->rig, variants, 2, err);
    if (ok) {
        report(bench, scene, "cone lights", variants, 2);
        tell(bench, scene,
             &(struct target){"cone lights", "frame cpu 250 / 10",
                              frame_cpu(&variants[1]) / frame_cpu(&variants[0]), 2});
    }
    frames_finish(variants, 2);
    return ok;
}

/* Rounds differ more than the frames of one: the median of the exponents of the rounds. */
static double exponent_of_rounds(const struct frame_variant *variants, const double *counts)
{
    struct samples exponents = {0};
    size_t rounds = variants[0].measurement.cpu_ms.count;
    for (size_t round = 0; round < rounds && round < ROUNDS_MAX; round++) {
        double build[STEPS];
        for (int i = 0; i < STEPS; i++) {
            const struct part_series *part =
                measurement_part(&variants[i].measurement, PART_SHADOW);
            build[i] = part && round < part->cpu_ms.count ? part->cpu_ms.values[round] : NAN;
        }
        samples_add(&exponents, fit_exponent(counts, build, STEPS));
    }
    double median = samples_summary(&exponents).median;
    samples_finish(&exponents);
    return median;
}

/* All lights move, so all maps are built in each frame; the picture is small, as building does not
 * depend on it. */
static bool run_moving(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    struct view_light spots[SPOTS];
    struct frame_variant variants[STEPS];
    double counts[STEPS];
    const struct bench_options options = bench->options;
    static const char *const names[STEPS] = {"5", "10", "15", "20", "25"};
    bench_scene_spots(scene, spots, SPOTS);
    for (int i = 0; i < STEPS; i++) {
        variants[i] = variant_of(bench, scene, names[i], spots, (size_t)(5 * (i + 1)));
        variants[i].view.quality.shadows = SHADOWS_DEEP;
        variants[i].view.quality.shadow_resolution = 512;
        variants[i].view.width_px = 256;
        variants[i].view.height_px = 192;
        variants[i].rebuilds_shadows = true;
        counts[i] = 5 * (i + 1);
    }
    if (!options.is_quick && options.seconds <= 0)
        bench->options.seconds = MOVING_SECONDS;
    bool ok = frames_run(bench, &scene->rig, variants, STEPS, err);
    bench->options = options;
    if (ok) {
        report(bench, scene, "spots that move, 512^2", variants, STEPS);
        tell(bench, scene,
             &(struct target){"spots that move, 512^2", "exponent of build cpu, 5 to 25",
                              exponent_of_rounds(variants, counts), 1.05});
        tell(bench, scene,
             &(struct target){"spots that move, 512^2", "build cpu a light, 25 / 5",
                              build_cpu(&variants[STEPS - 1]) / build_cpu(&variants[0]) / STEPS,
                              0});
    }
    frames_finish(variants, STEPS);
    return ok;
}

/* A deep map of casters that are all made opaque, and of the curtains, beside a plain depth map. */
static bool run_build(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    static char names[MATERIALS_MAX][8];
    static struct view_material_override opaque[MATERIALS_MAX];
    static const char *const variant_names[] = {"opaque, map", "opaque, deep", "curtains, map",
                                                "curtains, deep"};
    struct frame_variant variants[4];
    uint32_t count = scene->rig.imported.scene.material_count;
    if (count > MATERIALS_MAX)
        return error_set(err, ERROR_INTERNAL, "%u materials", count);
    for (uint32_t i = 0; i < count; i++) {
        snprintf(names[i], sizeof names[i], "#%u", i % MATERIALS_MAX);
        opaque[i] = (struct view_material_override){.material = names[i],
                                                    .has_transmission = true,
                                                    .has_alpha_mode = true,
                                                    .alpha_mode = SCENE_OPAQUE};
    }
    for (int i = 0; i < 4; i++) {
        struct frame_variant *v = &variants[i];
        *v = variant_of(bench, scene, variant_names[i], &scene->spot, 1);
        v->view.quality.shadows = i % 2 ? SHADOWS_DEEP : SHADOWS_MAP;
        v->view.quality.shadow_resolution = 1024;
        v->rebuilds_shadows = true;
        if (i < 2) {
            v->view.materials = opaque;
            v->view.material_override_count = count;
        }
    }
    bool ok = frames_run(bench, &scene->rig, variants, 4, err);
    if (ok) {
        const struct frame_report *bare = &variants[1].measurement.report;
        const struct frame_report *layered = &variants[3].measurement.report;
        double layered_ms = build_cpu(&variants[3]);
        double layers = fmax(layered->counts.mean_list, 1);
        report(bench, scene, "1 spot, 1024^2", variants, 4);
        tell(bench, scene,
             &(struct target){"1 spot, 1024^2", "events of opaque casters",
                              (double)bare->counts.events, 0});
        tell(bench, scene,
             &(struct target){"1 spot, 1024^2", "build cpu opaque deep / map",
                              build_cpu(&variants[1]) / build_cpu(&variants[0]), 1.5});
        /* of the same casters: the plain map of the curtains leaves them out */
        tell(bench, scene,
             &(struct target){"1 spot, 1024^2", "build cpu deep / opaque map, a layer",
                              layered_ms / build_cpu(&variants[0]) / layers, 3});
        tell(bench, scene,
             &(struct target){"1 spot, 1024^2", "build cpu deep / map without curtains",
                              layered_ms / build_cpu(&variants[2]), 0});
    }
    frames_finish(variants, 4);
    return ok;
}

static bool run_scene(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    return run_many(bench, scene, err) && run_build(bench, scene, err) &&
           standing_run(bench, scene, SPOTS, err) && run_moving(bench, scene, err);
}

bool suite_targets(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_scene, err);
}

/* SPDX-License-Identifier: MIT */
/* Suite `area`: soft shadows by grids of triangles against rays to the same points of a light, in
 * one run: at equal numbers of points, with casters that stand and that move, at equal time, and
 * against the size of the light (Wang et al. 2014, tables 5, 6, 10 and 11). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "glb/shapes.h"
#include "tests/bench/frames.h"
#include "tests/support/light_scene.h"

enum { AREA, RAYS, TABLE, AREA_MOVING, RAYS_MOVING, VARIANTS };
enum { COUNTS = 3, SIZES = 5 };

static const int sample_counts[COUNTS] = {16, 64, 256};
static const char *const variant_names[VARIANTS] = {"area", "rays", "area, faithful",
                                                    "area, moving", "rays, moving"};

/* ---- scenes ---- */

static void add_spheres(struct shape *shape)
{
    for (int i = 0; i < 100; i++)
        shape_add_sphere(shape, (double[]){(i % 10) - 4.5, 0.6 + 0.1 * (i % 7), (i / 10) - 4.5},
                         0.35, 16, 8);
}

/* Thin sticks in all directions, as in a nest. */
static void add_sticks(struct shape *shape)
{
    uint64_t seed = 5;
    for (int i = 0; i < 1000; i++) {
        double around = random_uniform(&seed, 0, 2 * M_PI), rise = random_uniform(&seed, -0.3, 0.3);
        const double along[3] = {cos(around) * cos(rise), sin(rise), sin(around) * cos(rise)};
        const double across[3] = {-sin(around), 0, cos(around)};
        const double at[3] = {random_uniform(&seed, -2.5, 2.5), random_uniform(&seed, 0.5, 1.5),
                              random_uniform(&seed, -2.5, 2.5)};
        shape_set_place(shape, at, across, along);
        shape_add_cylinder(shape, (double[]){0, 0, 0}, 0.03, 2, 6);
    }
    shape_set_place(shape, NULL, NULL, NULL);
}

static const struct area_scene {
    const char *name;
    void (*add)(struct shape *shape);
} scenes[] = {{"spheres", add_spheres}, {"sticks", add_sticks}};

static void add_part(struct glb_builder *builder, struct shape *shape, const char *name, int gray)
{
    int mesh = shape_give_mesh(shape, builder, name, gray);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = name, .mesh = mesh});
}

static bool open_scene(struct bench *bench, const struct area_scene *scene, struct rig_scene *rig,
                       struct error *err)
{
    struct shape casters = {0}, floor = {0};
    struct glb_builder *builder = glb_builder_create("Area", err);
    if (!builder)
        return false;
    int gray = glb_builder_add_material(
        builder, &(struct glb_material_desc){.base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1});
    scene->add(&casters);
    shape_add_quad(&floor, (double[]){-9, 0, -9}, (double[]){0, 0, 18}, (double[]){18, 0, 0});
    add_part(builder, &casters, "Casters", gray);
    add_part(builder, &floor, "Floor", gray);
    return rig_scene_from_builder(rig, bench_renderer(bench), scene->name, builder, err);
}

static const struct view_node_override moved = {
    .node = "Casters",
    .has_matrix = true,
    .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};

static struct view_light lamp_of(double side_m)
{
    return (struct view_light){.type = SCENE_LIGHT_RECT,
                               .position = {2, 9, 1},
                               .direction = {-0.2, -1, -0.1},
                               .up = {0, 0, 1},
                               .color = {1, 1, 1},
                               .intensity = 100,
                               .width_m = side_m,
                               .height_m = side_m};
}

static struct view view_of(const struct view_light *lamp, const int size[2], bool is_by_rays,
                           int samples)
{
    return (struct view){
        .width_px = size[0],
        .height_px = size[1],
        .outputs = 1u << VIEW_OUTPUT_COLOR,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {5, 5, 6},
                   .target = {0, 0.5, 0},
                   .fov_y_deg = 50},
        .lights = lamp,
        .light_count = 1,
        .quality = {.shadows = is_by_rays ? SHADOWS_RAYTRACED_SHADOWS : SHADOWS_AREA,
                    .area_samples = samples,
                    .samples = 1}};
}

/* ---- results ---- */

static void tell(struct bench *bench, const char *scene, const char *subject, const char *name,
                 double value)
{
    bench_check(bench,
                &(struct check){
                    .scene = scene, .subject = subject, .name = name, .value = value, .p = NAN});
}

static void tell_ratio(struct bench *bench, const char *scene, const char *subject,
                       const char *name, const struct samples *over, const struct samples *under)
{
    bench_check(bench, &(struct check){.scene = scene,
                                       .subject = subject,
                                       .name = name,
                                       .value = samples_summary(over).median /
                                                samples_summary(under).median,
                                       .p = samples_difference_p(over, under)});
}

/* Points of a light to which rays take so long; between two counts time goes straight. */
static double points_at(const double ms[COUNTS], double wanted_ms)
{
    int i = 0;
    while (i < COUNTS - 2 && ms[i + 1] < wanted_ms)
        i++;
    double share = (wanted_ms - ms[i]) / (ms[i + 1] - ms[i]);
    return sample_counts[i] + share * (sample_counts[i + 1] - sample_counts[i]);
}

/* ---- cases ---- */

static bool run_samples(struct bench *bench, const struct area_scene *scene,
                        const struct rig_scene *rig, int samples, double medians[VARIANTS],
                        struct error *err)
{
    const struct view_light lamp = lamp_of(1);
    struct frame_variant variants[VARIANTS] = {{0}};
    int size[2];
    char subject[32];
    bench_size(bench, 160, 120, size);
    snprintf(subject, sizeof subject, "%d points", samples);
    for (int i = 0; i < VARIANTS; i++)
        variants[i] = (struct frame_variant){
            .name = variant_names[i],
            .view = view_of(&lamp, size, i == RAYS || i == RAYS_MOVING, samples),
            .moved = i >= AREA_MOVING ? &moved : NULL};
    variants[TABLE].view.quality.faithful = true;
    bool ok = frames_run(bench, rig, variants, VARIANTS, err);
    for (int i = 0; ok && i < VARIANTS; i++) {
        const struct measurement *m = &variants[i].measurement;
        bench_result(bench, &(struct result){.scene = scene->name,
                                             .subject = subject,
                                             .variant = variant_names[i],
                                             .width = size[0],
                                             .height = size[1],
                                             .stage = PART_SHADOW,
                                             .measurement = m});
        medians[i] = samples_summary(&m->cpu_ms).median;
    }
    if (ok) {
        frames_print_split(bench, &variants[AREA]);
        tell_ratio(bench, scene->name, subject, "cpu area / rays",
                   &variants[AREA].measurement.cpu_ms, &variants[RAYS].measurement.cpu_ms);
        tell_ratio(bench, scene->name, subject, "cpu area, faithful / area",
                   &variants[TABLE].measurement.cpu_ms, &variants[AREA].measurement.cpu_ms);
        tell_ratio(bench, scene->name, subject, "cpu area / rays, moving",
                   &variants[AREA_MOVING].measurement.cpu_ms,
                   &variants[RAYS_MOVING].measurement.cpu_ms);
    }
    frames_finish(variants, VARIANTS);
    return ok;
}

static bool run_sizes(struct bench *bench, const struct area_scene *scene,
                      const struct rig_scene *rig, struct error *err)
{
    struct view_light lamps[SIZES];
    struct frame_variant variants[SIZES] = {{0}};
    double sides[SIZES], medians[SIZES];
    int size[2];
    bench_size(bench, 160, 120, size);
    for (int i = 0; i < SIZES; i++) {
        sides[i] = 0.5 * (i + 1);
        lamps[i] = lamp_of(sides[i]);
        variants[i] =
            (struct frame_variant){.name = "area", .view = view_of(&lamps[i], size, false, 64)};
    }
    bool ok = frames_run(bench, rig, variants, SIZES, err);
    for (int i = 0; ok && i < SIZES; i++)
        medians[i] = samples_summary(&variants[i].measurement.cpu_ms).median;
    if (ok)
        bench_series(bench, &(struct series){.scene = scene->name,
                                             .subject = "side of the light",
                                             .name = "area, 64 points",
                                             .of = "m",
                                             .unit = "ms",
                                             .x = sides,
                                             .y = medians,
                                             .count = SIZES,
                                             .growth = GROWTH_ANY});
    frames_finish(variants, SIZES);
    return ok;
}

static bool run_scene(struct bench *bench, const struct area_scene *scene, struct error *err)
{
    struct rig_scene rig = {0};
    double medians[COUNTS][VARIANTS], rays[COUNTS];
    const bool is_quick = bench->options.is_quick;
    bool ok = open_scene(bench, scene, &rig, err);
    for (int i = 0; ok && i < (is_quick ? 1 : COUNTS); i++) {
        ok = run_samples(bench, scene, &rig, sample_counts[i], medians[i], err);
        rays[i] = ok ? medians[i][RAYS] : 0;
    }
    for (int i = 0; ok && !is_quick && i < COUNTS; i++) {
        char subject[32];
        snprintf(subject, sizeof subject, "%d points", sample_counts[i]);
        tell(bench, scene->name, subject, "points of rays at equal cpu time",
             points_at(rays, medians[i][AREA]));
    }
    ok = ok && (is_quick || run_sizes(bench, scene, &rig, err));
    rig_scene_finish(&rig, bench_renderer(bench));
    return ok;
}

bool suite_area(struct bench *bench, struct error *err)
{
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++)
        if (bench_wants_scene(bench, scenes[i].name) && !run_scene(bench, &scenes[i], err))
            return false;
    return true;
}

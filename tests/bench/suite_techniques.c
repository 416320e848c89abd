/* SPDX-License-Identifier: MIT */
/* Suite `techniques`: time of a frame whose light moves, by each shadow technique, against the
 * number of translucent quads, on the scene of Modisett 2023, 5.3: 1000 opaque spheres in a box,
 * one directional light, and quads of which each is a mesh. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "glb/shapes.h"
#include "tests/bench/frames.h"
#include "tests/support/light_scene.h"

enum { TECHNIQUES = 9, COUNTS = 6, SPHERES = 1000, RESOLUTION = 512 };
enum { FAITHFUL_MOST = 256 }; /* meshes: SHADOW_PARTITIONS_MAX */
static const double HALF_M = 10;

static const int quad_counts[COUNTS] = {0, 125, 250, 500, 1000, 2000}, quick_counts[] = {0, 40};

static const struct {
    const char *name;
    enum shadow_technique shadows;
    bool faithful;
} techniques[TECHNIQUES] = {
    {"map", SHADOWS_MAP, false},
    {"translucent", SHADOWS_TRANSLUCENT, false},
    {"stochastic", SHADOWS_STOCHASTIC, false},
    {"colored-stochastic", SHADOWS_COLORED_STOCHASTIC, false},
    {"composited", SHADOWS_COMPOSITED, false},
    {"composited, faithful", SHADOWS_COMPOSITED, true},
    {"moments", SHADOWS_MOMENTS, false},
    {"deep", SHADOWS_DEEP, false},
    {"raytraced-shadows", SHADOWS_RAYTRACED_SHADOWS, false},
};

static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {-0.3, -1, -0.2},
                                      .color = {1, 1, 1},
                                      .intensity = 3};

struct timing { /* cpu ms of a frame, medians */
    double total[COUNTS], shadow[COUNTS];
};

static void place(double center[3], uint64_t *seed)
{
    for (int k = 0; k < 3; k++)
        center[k] = random_uniform(seed, -HALF_M, HALF_M);
}

static void add_spheres(struct glb_builder *builder, uint64_t *seed)
{
    struct shape shape = {0};
    int gray = glb_builder_add_material(
        builder, &(struct glb_material_desc){.base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1});
    for (int i = 0; i < SPHERES; i++) {
        double center[3];
        place(center, seed);
        shape_add_sphere(&shape, center, random_uniform(seed, 0.1, 0.4), 12, 8);
    }
    int mesh = shape_give_mesh(&shape, builder, "Spheres", gray);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Spheres", .mesh = mesh});
}

static void add_quads(struct glb_builder *builder, uint64_t *seed, int count)
{
    int blue = glb_builder_add_material(
        builder, &(struct glb_material_desc){.base_color = {0.3, 0.4, 1, 0.3},
                                             .roughness = 1,
                                             .alpha_mode = GLB_BLEND,
                                             .is_double_sided = true});
    for (int i = 0; i < count; i++) {
        struct shape shape = {0};
        double corner[3], turn = random_uniform(seed, 0, 6.28), side = random_uniform(seed, 0.5, 2);
        double lean = random_uniform(seed, -0.5, 0.5);
        place(corner, seed);
        shape_add_quad(&shape, corner, (double[]){side * cos(turn), side * lean, side * sin(turn)},
                       (double[]){-side * sin(turn), 0, side * cos(turn)});
        int mesh = shape_give_mesh(&shape, builder, "Quad", blue);
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Quad", .mesh = mesh});
    }
}

static bool open_scene(struct bench *bench, struct rig_scene *rig, int quads, struct error *err)
{
    uint64_t seed = 2023;
    struct glb_builder *builder = glb_builder_create("Techniques", err);
    if (!builder)
        return false;
    add_spheres(builder, &seed);
    add_quads(builder, &seed, quads);
    return rig_scene_from_builder(rig, bench_renderer(bench), "techniques", builder, err);
}

static struct view view_of(int technique, const int size[2])
{
    return (struct view){.width_px = size[0],
                         .height_px = size[1],
                         .outputs = 1u << VIEW_OUTPUT_COLOR,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {24, 14, 20},
                                    .target = {0, 0, 0},
                                    .fov_y_deg = 45},
                         .lights = &sun,
                         .light_count = 1,
                         .quality = {.shadows = techniques[technique].shadows,
                                     .faithful = techniques[technique].faithful,
                                     .shadow_resolution = RESOLUTION,
                                     .samples = 1}};
}

static bool is_drawn(int technique, int quads)
{
    return !techniques[technique].faithful || quads <= FAITHFUL_MOST;
}

/* Of maps, or of the passes of rays. */
static double median_shadow(const struct measurement *m)
{
    const struct part_series *maps = measurement_part(m, PART_SHADOW);
    double sum = 0;
    if (maps)
        return samples_summary(&maps->cpu_ms).median;
    for (int i = 0; i < m->part_count; i++)
        if (!strncmp(m->parts[i].name, "shadow.", strlen("shadow.")))
            sum += samples_summary(&m->parts[i].cpu_ms).median;
    return sum;
}

/* What is not of shadows is drawing and shading, so that both add up to the frame. */
static void tell(struct bench *bench, const char *subject, const int size[2],
                 const struct frame_variant *variant)
{
    const struct measurement *m = &variant->measurement;
    double total = samples_summary(&m->cpu_ms).median, shadow = median_shadow(m);
    const struct {
        const char *name;
        double value;
    } figures[] = {{"total", total}, {"shadow", shadow}, {"shading", total - shadow}};
    bench_result(bench, &(struct result){.scene = "spheres",
                                         .subject = subject,
                                         .variant = variant->name,
                                         .width = size[0],
                                         .height = size[1],
                                         .stage = PART_SHADOW,
                                         .measurement = m});
    for (size_t i = 0; i < sizeof figures / sizeof *figures; i++) {
        char name[64];
        snprintf(name, sizeof name, "%s: %s, cpu ms", variant->name, figures[i].name);
        bench_check(bench, &(struct check){.scene = "spheres",
                                           .subject = subject,
                                           .name = name,
                                           .value = figures[i].value,
                                           .p = NAN});
    }
}

static bool run_count(struct bench *bench, int at, int quads, struct timing timings[TECHNIQUES],
                      struct error *err)
{
    struct frame_variant variants[TECHNIQUES] = {{0}};
    struct rig_scene rig = {0};
    int size[2], count = 0, which[TECHNIQUES];
    char subject[32];
    bench_size(bench, 320, 240, size);
    snprintf(subject, sizeof subject, "%d quads", quads);
    for (int i = 0; i < TECHNIQUES; i++)
        if (is_drawn(i, quads)) {
            which[count] = i;
            variants[count++] = (struct frame_variant){
                .name = techniques[i].name, .view = view_of(i, size), .rebuilds_shadows = true};
        }
    bool ok = open_scene(bench, &rig, quads, err) &&
              frames_run(bench, &rig, variants, (size_t)count, err);
    for (int i = 0; ok && i < count; i++) {
        tell(bench, subject, size, &variants[i]);
        timings[which[i]].total[at] = samples_summary(&variants[i].measurement.cpu_ms).median;
        timings[which[i]].shadow[at] = median_shadow(&variants[i].measurement);
    }
    frames_finish(variants, (size_t)count);
    rig_scene_finish(&rig, bench_renderer(bench));
    return ok;
}

/* Of the counts from the second on: a power law has no value for none. */
static void tell_growth(struct bench *bench, const struct timing timings[TECHNIQUES])
{
    double x[COUNTS];
    for (int i = 0; i < COUNTS; i++)
        x[i] = quad_counts[i];
    for (int t = 0; t < TECHNIQUES; t++) {
        int count = 0;
        while (count < COUNTS && is_drawn(t, quad_counts[count]))
            count++;
        bench_series(bench, &(struct series){.scene = "spheres",
                                             .subject = "quads",
                                             .name = techniques[t].name,
                                             .of = "translucent quads",
                                             .unit = "ms",
                                             .x = x + 1,
                                             .y = timings[t].total + 1,
                                             .count = count - 1,
                                             .growth = GROWTH_ANY});
    }
}

bool suite_techniques(struct bench *bench, struct error *err)
{
    struct timing timings[TECHNIQUES] = {{{0}, {0}}};
    bool is_quick = bench->options.is_quick;
    const int *counts = is_quick ? quick_counts : quad_counts;
    for (int i = 0; i < (is_quick ? 2 : COUNTS); i++)
        if (!run_count(bench, i, counts[i], timings, err))
            return false;
    if (!is_quick)
        tell_growth(bench, timings);
    return true;
}

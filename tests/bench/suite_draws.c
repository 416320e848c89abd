/* SPDX-License-Identifier: MIT */
/* Suite `draws`: assemblies of 100 to 15,600 small objects (the number of Lindbeck 2015, 4.1) of
 * few meshes and materials, one in eight of glass: what a frame costs by the number of its objects.
 *
 * Variants: all objects in view; from amid them, where most are out of view; with the shadows of a
 * spot and a point light built anew; one object moved in each frame; 25 standing shadows. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "glb/shapes.h"
#include "tests/bench/frames.h"

enum { STEPS_MAX = 4, MATERIALS = 8, MESHES = 3, VARIANTS = 5, STANDING = 25 };
enum {
    STANDS = VARIANTS - 1
}; /* this variant's shadows; it runs apart from those that drop them */

static const double SIDE_M = 4; /* of the cube that holds all objects, whatever their number */

/* One of the meshes in one of the materials, 0.35 m across in a cell of 1 m. */
static int add_mesh(struct glb_builder *builder, int kind, int material)
{
    struct shape shape = {0};
    if (kind == 0)
        shape_add_box(&shape, (double[]){-0.35, -0.35, -0.35}, (double[]){0.35, 0.35, 0.35});
    else if (kind == 1)
        shape_add_sphere(&shape, (double[]){0, 0, 0}, 0.35, 10, 6);
    else
        shape_add_cylinder(&shape, (double[]){0, -0.35, 0}, 0.3, 0.7, 10);
    return shape_give_mesh(&shape, builder, "Part", material);
}

static int add_material(struct glb_builder *builder, int index)
{
    struct glb_material_desc desc = {
        .name = "Material",
        .base_color = {0.3 + 0.08 * index, 0.9 - 0.1 * index, 0.35 + 0.07 * (index * 3 % 8), 1},
        .roughness = 0.6};
    if (index == MATERIALS - 1) {
        desc.transmission = 0.9;
        desc.is_double_sided = true;
    }
    return glb_builder_add_material(builder, &desc);
}

static bool build_assembly(int count, void **glb, size_t *size, struct error *err)
{
    struct glb_builder *builder = glb_builder_create("assembly", err);
    if (!builder)
        return false;
    int meshes[MATERIALS][MESHES];
    for (int m = 0; m < MATERIALS; m++) {
        int material = add_material(builder, m);
        for (int k = 0; k < MESHES; k++)
            meshes[m][k] = add_mesh(builder, k, material);
    }
    int side = (int)ceil(cbrt(count));
    double cell = SIDE_M / side;
    for (int i = 0; i < count; i++) {
        char name[24];
        snprintf(name, sizeof name, "part-%d", i);
        unsigned mixed = (unsigned)i * 2654435761u >> 16;
        struct glb_node_desc node = {.name = name,
                                     .mesh = meshes[mixed % MATERIALS][mixed / MATERIALS % MESHES],
                                     .translation = {cell * (i % side + 0.5) - SIDE_M / 2,
                                                     cell * (i / side % side + 0.5),
                                                     cell * (i / side / side + 0.5) - SIDE_M / 2},
                                     .scale = {cell, cell, cell}};
        glb_node_rotate(&node, (double[]){0, 1, 0}, mixed % 90);
        glb_builder_add_node(builder, &node);
    }
    bool ok = glb_builder_finish(builder, glb, size, err);
    glb_builder_destroy(builder);
    return ok;
}

/* Two lights near the assembly; more of them in a ring above it. */
static void place_lights(struct view_light lights[STANDING])
{
    for (int i = 0; i < STANDING; i++) {
        double turn = 2 * M_PI * i / STANDING;
        lights[i] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                        .position = {5 * cos(turn), 7, 5 * sin(turn)},
                                        .direction = {-cos(turn), -1, -sin(turn)},
                                        .color = {1, 1, 1},
                                        .intensity = i < 2 ? 120 : 12,
                                        .outer_cone_deg = 40};
    }
    lights[1].type = SCENE_LIGHT_POINT;
    memcpy(lights[1].position, (double[]){0.1, 2.1, 0.1}, sizeof lights[1].position);
    lights[1].intensity = 10;
}

struct draws_case {
    struct rig_scene rig;
    struct view_light lights[STANDING];
    struct view_node_override moved; /* one part, above the others */
    struct frame_variant variants[VARIANTS];
};

static void describe_variants(struct draws_case *c, const int size[2])
{
    static const char *const names[VARIANTS] = {"all in view", "from amid", "shadows rebuilt",
                                                "one part moves", "25 standing shadows"};
    struct view view = {.width_px = size[0],
                        .height_px = size[1],
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                   .eye = {5, 5, 6},
                                   .target = {0, 1.8, 0},
                                   .fov_y_deg = 45},
                        .has_environment = true,
                        .sky = {0.3f, 0.3f, 0.35f},
                        .ground = {0.1f, 0.1f, 0.1f},
                        .lights = c->lights,
                        .light_count = 2,
                        .quality = {.samples = 1, .shadow_resolution = 256}};
    place_lights(c->lights);
    for (int i = 0; i < VARIANTS; i++)
        c->variants[i] = (struct frame_variant){.name = names[i], .view = view};
    struct view_camera *amid = &c->variants[1].view.camera;
    memcpy(amid->eye, (double[]){0.1, 2.1, 0.1}, sizeof amid->eye);
    memcpy(amid->target, (double[]){1, 2.2, 2}, sizeof amid->target);
    c->variants[2].rebuilds_shadows = true;
    c->variants[3].moved = &c->moved;
    c->variants[4].view.light_count = STANDING;
    c->moved = (struct view_node_override){.node = "part-7", .has_matrix = true};
    double *m = c->moved.matrix;
    m[0] = m[5] = m[10] = 0.3;
    m[13] = SIDE_M + 0.5;
    m[15] = 1;
}

static bool run_case(struct bench *bench, int count, double cpu_ms[VARIANTS], struct error *err)
{
    struct draws_case c = {0};
    void *glb = NULL;
    size_t bytes = 0;
    int size[2];
    char key[32], subject[32];
    snprintf(key, sizeof key, "assembly-%d", count);
    snprintf(subject, sizeof subject, "%d objects", count);
    bench_size(bench, 640, 480, size);
    describe_variants(&c, size);
    bool ok = build_assembly(count, &glb, &bytes, err) &&
              rig_scene_from_glb(&c.rig, bench_renderer(bench), key, glb, bytes, err) &&
              frames_run(bench, &c.rig, c.variants, STANDS, err) &&
              frames_run(bench, &c.rig, &c.variants[STANDS], 1, err);
    for (int i = 0; ok && i < VARIANTS; i++) {
        const struct measurement *m = &c.variants[i].measurement;
        cpu_ms[i] = samples_summary(&m->cpu_ms).median;
        bench_result(bench, &(struct result){.scene = "assembly",
                                             .subject = subject,
                                             .variant = c.variants[i].name,
                                             .width = size[0],
                                             .height = size[1],
                                             .stage = PART_SHADOW,
                                             .measurement = m});
        frames_print_split(bench, &c.variants[i]);
    }
    free(glb);
    frames_finish(c.variants, VARIANTS);
    rig_scene_finish(&c.rig, bench_renderer(bench));
    return ok;
}

bool suite_draws(struct bench *bench, struct error *err)
{
    static const int numbers[STEPS_MAX] = {100, 1000, 10000, 15600};
    static const char *const names[VARIANTS] = {
        "frame cpu, all in view", "frame cpu, from amid", "frame cpu, shadows rebuilt",
        "frame cpu, one part moves", "frame cpu, 25 standing shadows"};
    int steps = bench->options.is_quick ? 2 : STEPS_MAX;
    double counts[STEPS_MAX], cpu[VARIANTS][STEPS_MAX];
    for (int i = 0; i < steps; i++) {
        double cpu_ms[VARIANTS];
        if (!bench_wants_scene(bench, "assembly"))
            return true;
        if (!run_case(bench, numbers[i], cpu_ms, err))
            return error_wrap(err, "%d objects", numbers[i]);
        counts[i] = numbers[i];
        for (int k = 0; k < VARIANTS; k++)
            cpu[k][i] = cpu_ms[k];
    }
    for (int k = 0; k < VARIANTS; k++)
        bench_series(bench, &(struct series){.scene = "assembly",
                                             .subject = "objects",
                                             .name = names[k],
                                             .of = "objects",
                                             .unit = "ms",
                                             .x = counts,
                                             .y = cpu[k],
                                             .count = steps,
                                             .growth = GROWTH_LINEAR});
    return true;
}

/* SPDX-License-Identifier: MIT */
/* The demo scene and Sponza with transparent curtains. */
#include "tests/bench/scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "glb/demo_scene.h"
#include "glb/shapes.h"
#include "tests/support/light_scene.h"

#define SPONZA_PATH "Sponza/glTF/Sponza.gltf"

bool bench_demo_open(struct bench_scene *scene, struct renderer *renderer, struct error *err)
{
    *scene = (struct bench_scene){.name = "demo"};
    void *glb = NULL;
    size_t size = 0;
    if (!demo_scene_build(&(struct demo_scene_desc){0}, &glb, &size, err))
        return false;
    bool ok = rig_scene_from_glb(&scene->rig, renderer, "demo", glb, size, err);
    free(glb);
    scene->camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT, /* the node "Nave" */
                                         .eye = {1.0, 1.75, 6.6},
                                         .target = {-0.45, 2.95, -10},
                                         .fov_y_deg = 52};
    memcpy(scene->box_min, (double[]){-4.5, 2.2, -9.5}, sizeof scene->box_min);
    memcpy(scene->box_max, (double[]){4.5, 5, 6}, sizeof scene->box_max);
    scene->light_range_m = 4;
    /* from above the nave through the left curtains and onto floor and wall behind them */
    scene->spot = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                      .position = {1.5, 4.6, 0.5},
                                      .direction = {-0.8, -0.55, -0.1},
                                      .color = {1, 1, 1},
                                      .intensity = 120,
                                      .inner_cone_deg = 25,
                                      .outer_cone_deg = 40};
    return ok;
}

/* Every fabric becomes coverage of 0.6 with its own colour. */
static void add_curtains(struct bench_scene *scene)
{
    const struct scene *s = &scene->rig.imported.scene;
    for (uint32_t i = 0; i < s->material_count && scene->curtain_count < CURTAINS_MAX; i++) {
        const char *name = s->strings + s->materials[i].name;
        if (strncmp(name, "fabric", 6) != 0)
            continue;
        scene->curtains[scene->curtain_count++] = (struct view_material_override){
            .material = name,
            .has_base_color = true,
            .base_color = {1, 1, 1, 0.6f},
            .has_alpha_mode = true,
            .alpha_mode = SCENE_BLEND,
        };
    }
}

static bool open_sponza(struct bench_scene *scene, struct renderer *renderer, struct error *err)
{
    *scene = (struct bench_scene){.name = "sponza"};
    if (!rig_scene_from_asset(&scene->rig, renderer, SPONZA_PATH, err))
        return false;
    add_curtains(scene);
    scene->camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                         .eye = {8.5, 2.2, -0.6},
                                         .target = {-4, 2.2, 0.4},
                                         .fov_y_deg = 60};
    memcpy(scene->box_min, (double[]){-9.5, 2, -4}, sizeof scene->box_min);
    memcpy(scene->box_max, (double[]){8, 6, 3.5}, sizeof scene->box_max);
    scene->light_range_m = 5;
    scene->spot = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                      .position = {6.5, 3.4, -0.8},
                                      .direction = {-0.45, -0.3, 0.8},
                                      .color = {1, 1, 1},
                                      .intensity = 300,
                                      .inner_cone_deg = 30,
                                      .outer_cone_deg = 45};
    return true;
}

bool bench_spheres_open(struct rig_scene *rig, struct renderer *renderer, int stacks,
                        struct error *err)
{
    struct shape shape = {0};
    struct glb_builder *builder = glb_builder_create("Spheres", err);
    if (!builder)
        return false;
    int gray = glb_builder_add_material(
        builder, &(struct glb_material_desc){.base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1});
    for (int i = 0; i < SPHERES_SIDE * SPHERES_SIDE; i++) {
        double x = i % SPHERES_SIDE - 4.5, z = i / SPHERES_SIDE - 4.5;
        shape_add_sphere(&shape, (double[]){x, 0.6 + 0.1 * (i % 7), z}, 0.35, 2 * stacks, stacks);
    }
    shape_add_quad(&shape, (double[]){-9, 0, -9}, (double[]){0, 0, 18}, (double[]){18, 0, 0});
    int mesh = shape_give_mesh(&shape, builder, "Spheres", gray);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Spheres", .mesh = mesh});
    return rig_scene_from_builder(rig, renderer, "spheres", builder, err);
}

void bench_scene_close(struct bench_scene *scene, struct renderer *renderer)
{
    rig_scene_finish(&scene->rig, renderer);
    *scene = (struct bench_scene){0};
}

static bool run_demo(struct bench *bench,
                     bool (*run)(struct bench *, const struct bench_scene *, struct error *),
                     struct error *err)
{
    struct bench_scene scene;
    bool ok = bench_demo_open(&scene, bench_renderer(bench), err) && run(bench, &scene, err);
    bench_scene_close(&scene, bench_renderer(bench));
    return ok;
}

static bool run_sponza(struct bench *bench,
                       bool (*run)(struct bench *, const struct bench_scene *, struct error *),
                       struct error *err)
{
    struct bench_scene scene;
    if (access(VITRAIL_ASSET_DIR "/" SPONZA_PATH, R_OK) != 0) {
        fprintf(stderr, "%s: Sponza is not on this machine\n", bench->suite);
        return true;
    }
    bool ok = open_sponza(&scene, bench_renderer(bench), err) && run(bench, &scene, err);
    bench_scene_close(&scene, bench_renderer(bench));
    return ok;
}

bool bench_scenes_run(struct bench *bench,
                      bool (*run)(struct bench *bench, const struct bench_scene *scene,
                                  struct error *err),
                      struct error *err)
{
    if (bench_wants_scene(bench, "demo") && !run_demo(bench, run, err))
        return error_wrap(err, "scene 'demo'");
    if (bench_wants_scene(bench, "sponza") && !bench->options.is_quick &&
        !run_sponza(bench, run, err))
        return error_wrap(err, "scene 'sponza'");
    return true;
}

struct view bench_scene_view(const struct bench_scene *scene, const int size[2])
{
    return (struct view){
        .width_px = size[0],
        .height_px = size[1],
        .camera = scene->camera,
        .ignore_scene_lights = true,
        .materials = scene->curtains,
        .material_override_count = scene->curtain_count,
        .quality = {.samples = 1},
    };
}

void bench_scene_cones(const struct bench_scene *scene, struct view_light *lights, int count)
{
    uint64_t seed = 20150312;
    for (int i = 0; i < count; i++) {
        struct view_light *light = &lights[i];
        *light = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                     .intensity = 8,
                                     .range = (float)scene->light_range_m,
                                     .inner_cone_deg = 18,
                                     .outer_cone_deg = 25,
                                     .casts_no_shadow = true};
        for (int k = 0; k < 3; k++) {
            light->position[k] = random_uniform(&seed, scene->box_min[k], scene->box_max[k]);
            light->direction[k] = k == 1 ? -1 : random_uniform(&seed, -0.8, 0.8);
            light->color[k] = (float)random_uniform(&seed, 0.2, 1);
        }
    }
}

void bench_scene_spots(const struct bench_scene *scene, struct view_light *lights, int count)
{
    uint64_t seed = 3141592;
    for (int i = 0; i < count; i++) {
        lights[i] = scene->spot;
        lights[i].intensity *= 3 / (float)count;
        for (int k = 0; k < 3; k++) {
            lights[i].position[k] += random_uniform(&seed, -0.4, 0.4);
            lights[i].direction[k] += random_uniform(&seed, -0.15, 0.15);
            lights[i].color[k] = (float)random_uniform(&seed, 0.3, 1);
        }
    }
}

/* SPDX-License-Identifier: MIT */
/* Layers of smoke, and the frames of suite `smoke` that show them. */
#include "tests/bench/close_up.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "glb/glb_builder.h"
#include "protocol/quality_defaults.h"
#include "renderer/cost/workload.h"
#include "renderer/scene/atmosphere_grid.h"
#include "tests/bench/frames.h"
#include "tests/support/boxes.h"

enum { LAYERS = 6, LIGHTS_MOST = 25, STEPS_MOST = 256 };
enum { OURS, WALKED, VARIANTS };
static const uint32_t voxels[3] = {48, 28, 6};
static const double FASTER_LEAST = 3; /* than a walk per step */

/* Wisps: a sum of waves, cut off below. */
static void fill_layer(float *values, int layer)
{
    for (uint32_t z = 0; z < voxels[2]; z++)
        for (uint32_t y = 0; y < voxels[1]; y++)
            for (uint32_t x = 0; x < voxels[0]; x++) {
                double u = 0.31 * x + 1.7 * layer, v = 0.42 * y - 0.9 * layer, w = 0.8 * z;
                double wave = sin(u) * sin(v + 0.5 * w) + 0.5 * sin(2.1 * u + w) * sin(1.7 * v);
                *values++ = (float)fmax(0.35 + wave, 0);
            }
}

static bool add_layers(struct glb_builder *builder, struct error *err)
{
    size_t count = (size_t)voxels[0] * voxels[1] * voxels[2];
    float *values = malloc(count * sizeof *values);
    if (!values)
        return error_set(err, ERROR_NO_MEMORY, "layers of smoke");
    for (int i = 0; i < LAYERS; i++) {
        double far = -1.2 - 0.55 * i;
        fill_layer(values, i);
        int grid = glb_builder_add_grid(
            builder, &(struct glb_grid_desc){.name = "Layer",
                                             .size = {voxels[0], voxels[1], voxels[2]},
                                             .values = values,
                                             .low = {-2.2, -1.2, far},
                                             .high = {2.2, 1.2, far + 0.4},
                                             .density = 1.2,
                                             .anisotropy = 0.3});
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Layer", .grid = grid});
    }
    free(values);
    return true;
}

static bool open_scene(struct rig_scene *rig, struct renderer *renderer, struct error *err)
{
    static const struct glb_material_desc dull = {
        .name = "Wall", .base_color = {0.6f, 0.6f, 0.6f, 1}, .roughness = 1};
    struct glb_builder *builder = glb_builder_create("Close-up", err);
    if (!builder)
        return false;
    builder_add_box(builder, &dull, (const double[]){-6, -4, -6.1}, (const double[]){6, 4, -6});
    if (add_layers(builder, err))
        return rig_scene_from_builder(rig, renderer, "close-up", builder, err);
    glb_builder_destroy(builder);
    return false;
}

/* In a ring around the way of the camera, towards its middle. */
static void place_lights(struct view_light lights[LIGHTS_MOST])
{
    for (int i = 0; i < LIGHTS_MOST; i++) {
        double turn = 2.399963 * i, z = -0.4 - 4.5 * i / LIGHTS_MOST; /* the golden angle */
        lights[i] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                        .position = {3 * cos(turn), 3 * sin(turn), z},
                                        .direction = {-cos(turn), -sin(turn), -0.2},
                                        .color = {1, 0.5f + 0.02f * (float)i, 0.4f},
                                        .intensity = 12,
                                        .inner_cone_deg = 25,
                                        .outer_cone_deg = 35};
    }
}

static struct view look(const int size[2], const struct view_light *lights, size_t count)
{
    return (struct view){
        .width_px = size[0],
        .height_px = size[1],
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 0, -1}, .fov_y_deg = 45},
        .studio = VIEW_STUDIO_OFF,
        .lights = lights,
        .light_count = count,
        .quality = {.samples = 1, .shadows = SHADOWS_DEEP, .shadow_taps = 1},
    };
}

/* As published, with a column for each pixel, so that light is found at each step of its ray. */
static void walk_each_step(struct view *view)
{
    view->quality.shadows = SHADOWS_DEEP_LINKED;
    view->quality.faithful = true;
    view->quality.atmosphere_samples = ATMOSPHERE_SLICES_DEFAULT;
    while (atmosphere_side_px(view) > 1 && view->quality.atmosphere_samples < STEPS_MOST)
        view->quality.atmosphere_samples++;
}

static bool count_steps(const struct rig_scene *rig, const struct view *view, double *steps,
                        struct error *err)
{
    struct scene_state state = {0};
    struct camera camera;
    struct workload workload;
    bool ok = scene_state_init(&state, &rig->imported.scene, view, err) &&
              camera_resolve(&camera, view, &state, err) &&
              workload_measure(
                  &workload,
                  &(struct workload_desc){.view = view, .state = &state, .camera = &camera}, err);
    scene_state_finish(&state);
    *steps = ok ? workload.grid_nodes : NAN;
    return ok;
}

static void tell(struct bench *bench, const char *subject, const char *name, double ours,
                 double walked, bool is_bound)
{
    char text[64];
    for (int i = 0; i < VARIANTS; i++) {
        snprintf(text, sizeof text, "%s%s", name, i == OURS ? "" : ", walked");
        bench_check(bench, &(struct check){.scene = "close-up",
                                           .subject = subject,
                                           .name = text,
                                           .value = i == OURS ? ours : walked,
                                           .p = NAN});
    }
    snprintf(text, sizeof text, "%s walked / ours", name);
    bench_check(bench, &(struct check){.scene = "close-up",
                                       .subject = subject,
                                       .name = text,
                                       .value = walked / ours,
                                       .relation = is_bound ? ">=" : NULL,
                                       .bound = FASTER_LEAST,
                                       .p = NAN});
}

static bool run_lights(struct bench *bench, const struct rig_scene *rig, int count,
                       struct error *err)
{
    struct view_light lights[LIGHTS_MOST];
    int size[2];
    char subject[32];
    double steps[VARIANTS];
    place_lights(lights);
    bench_size(bench, 320, 180, size);
    snprintf(subject, sizeof subject, "%d lights", count);
    const struct view ours = look(size, lights, (size_t)count);
    struct frame_variant variants[VARIANTS] = {
        [OURS] = {.name = "deep", .view = ours, .moves_camera = true},
        [WALKED] = {.name = "a walk per step", .view = ours, .moves_camera = true}};
    walk_each_step(&variants[WALKED].view);
    bool ok = frames_run(bench, rig, variants, VARIANTS, err);
    if (ok)
        frames_tell(bench, "close-up", subject, variants, VARIANTS);
    for (int i = 0; ok && i < VARIANTS; i++) {
        frames_print_split(bench, &variants[i]);
        ok = count_steps(rig, &variants[i].view, &steps[i], err);
    }
    if (ok) {
        const struct measurement *m[VARIANTS] = {&variants[OURS].measurement,
                                                 &variants[WALKED].measurement};
        tell(bench, subject, "march steps", steps[OURS], steps[WALKED], false);
        tell(bench, subject, "lookups", (double)m[OURS]->report.counts.lookups,
             (double)m[WALKED]->report.counts.lookups, false);
        tell(bench, subject, "cpu ms", samples_summary(&m[OURS]->cpu_ms).median,
             samples_summary(&m[WALKED]->cpu_ms).median, true);
    }
    frames_finish(variants, VARIANTS);
    return ok;
}

bool close_up_run(struct bench *bench, struct error *err)
{
    struct rig_scene rig = {0};
    struct renderer *renderer = bench_renderer(bench);
    bool ok = open_scene(&rig, renderer, err) && run_lights(bench, &rig, 5, err) &&
              (bench->options.is_quick || run_lights(bench, &rig, LIGHTS_MOST, err));
    rig_scene_finish(&rig, renderer);
    return ok;
}

/* SPDX-License-Identifier: MIT */
/* Closed-form scenes of panes over a floor: parallel, overlapping, and random ones. */
#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/closed_form_internal.h"

static const double pi = 3.14159265358979323846;
static const double probe_half = 0.01; /* m */

struct panes_plan {
    double spacing, half, top;
};

static struct panes_plan plan_of(const struct panes_scene_desc *desc)
{
    struct panes_plan plan = {.spacing = desc->spacing > 0 ? desc->spacing : 0.1,
                              .half = desc->pane_half > 0 ? desc->pane_half : 1};
    plan.top = 1 + (desc->pane_count > 0 ? desc->pane_count - 1 : 0) * plan.spacing;
    return plan;
}

void panes_scene_probe(const struct panes_scene_desc *desc, int k, double point[3])
{
    /* On a circle: light from the axis reaches each along its own azimuth, past all others. */
    struct panes_plan plan = plan_of(desc);
    double angle = 2 * pi * k / (desc->pane_count + 1), radius = 0.6 * plan.half;
    double below_y = 1 + (desc->pane_count - 1 - k) * plan.spacing; /* of pane k, under the probe */
    point[0] = radius * cos(angle);
    point[1] = k == desc->pane_count ? 0.5 : below_y + 0.5 * plan.spacing;
    point[2] = radius * sin(angle);
}

static void add_probes(struct closed_form_scene *scene, struct glb_builder *builder,
                       const struct panes_scene_desc *desc)
{
    assert(0.13 * (desc->pane_count + 1) <= 17 * plan_of(desc).half); /* tiles do not touch */
    int material = closed_form_receiver(scene, builder);
    double h = probe_half, eye_height = 0.2 * plan_of(desc).spacing;
    if (eye_height > h)
        eye_height = h; /* a field of view of 45 degrees then sees the probe only */
    for (int k = 0; k <= desc->pane_count; k++) {
        char name[32];
        double p[3];
        panes_scene_probe(desc, k, p);
        snprintf(name, sizeof name, "Probe %d", k);
        closed_form_camera(builder, name, (double[]){p[0], p[1] + eye_height, p[2]}, p, 45);
        closed_form_quad(builder, "Probe tile", material, (double[]){p[0] - h, p[1], p[2] + h},
                         (double[]){2 * h, 0, 0}, (double[]){0, 0, -2 * h});
    }
}

void panes_scene_build(const struct panes_scene_desc *desc, struct closed_form_scene *scene)
{
    assert(desc->pane_count >= 0 && desc->pane_count <= 1024);
    struct panes_plan plan = plan_of(desc);
    struct glb_builder *builder = closed_form_begin(scene, "Panes", desc->pane_count);
    closed_form_camera(builder, "Floor", (double[]){0, 0.4, 0.5}, (double[]){0, 0, 0}, 45);
    closed_form_floor(scene, builder, 10);
    for (int k = 0; k < desc->pane_count; k++) {
        struct closed_form_pane *pane = &scene->panes[k];
        *pane = (struct closed_form_pane){
            .corner = {-plan.half, 1 + (desc->pane_count - 1 - k) * plan.spacing, plan.half},
            .u = {2 * plan.half, 0, 0},
            .v = {0, 0, -2 * plan.half},
            .is_blend = desc->is_blend};
        memcpy(pane->color, desc->colors[k], sizeof pane->color);
        if (!desc->is_blend)
            pane->color[3] = 1;
        closed_form_add_pane(builder, pane);
    }
    double standard = desc->light == GLB_LIGHT_DIRECTIONAL ? 4 : 100;
    scene->light =
        (struct closed_form_light){.type = desc->light,
                                   .position = {0, plan.top + 4, 0},
                                   .direction = {0, -1, 0},
                                   .intensity = desc->intensity > 0 ? desc->intensity : standard};
    closed_form_add_light(scene, builder);
    if (desc->has_probes)
        add_probes(scene, builder, desc);
    closed_form_end(scene, builder);
}

void overlap_scene_build(const struct overlap_scene_desc *desc, struct closed_form_scene *scene)
{
    static const double colors[3][3] = {{0.9, 0.1, 0.05}, {0.15, 0.8, 0.1}, {0.05, 0.2, 0.95}};
    static const int straight[3] = {0, 1, 2};
    const int *heights = desc->height_order, *files = desc->file_order;
    heights = heights[0] || heights[1] || heights[2] ? heights : straight;
    files = files[0] || files[1] || files[2] ? files : straight;
    struct glb_builder *builder = closed_form_begin(scene, "Overlap", 3);
    closed_form_camera_onto(builder, "Floor", (double[]){0, 0.8, 0}, (double[]){0, 0, 0}, 1);
    closed_form_floor(scene, builder, 4);
    for (int h = 0; h < 3; h++) {
        int c = heights[h];
        double angle = pi / 2 + c * 2 * pi / 3;
        scene->panes[c] = (struct closed_form_pane){
            .corner = {0.3 * cos(angle) - 0.5, 1 + 0.25 * h, 0.3 * sin(angle) + 0.5},
            .u = {1, 0, 0},
            .v = {0, 0, -1},
            .color = {colors[c][0], colors[c][1], colors[c][2], desc->is_blend ? 0.6 : 1},
            .is_blend = desc->is_blend};
    }
    for (int i = 0; i < 3; i++)
        closed_form_add_pane(builder, &scene->panes[files[i]]);
    scene->light = (struct closed_form_light){.type = GLB_LIGHT_DIRECTIONAL,
                                              .position = {0, 6, 0},
                                              .direction = {0, -1, 0},
                                              .intensity = 4};
    closed_form_add_light(scene, builder);
    closed_form_end(scene, builder);
}

/* A parallelogram around center, turned about +Y and then tilted. */
static void random_pane(uint64_t *state, int index, struct closed_form_pane *pane)
{
    double yaw = closed_form_random(state, 0, 2 * pi);
    double tilt = closed_form_random(state, 0, 50 * pi / 180);
    double width = closed_form_random(state, 0.3, 1.5),
           length = closed_form_random(state, 0.3, 1.5);
    double shear = closed_form_random(state, -0.4, 0.4);
    double center[3] = {closed_form_random(state, -1.5, 1.5), closed_form_random(state, 1.6, 3.5),
                        closed_form_random(state, -1.5, 1.5)};
    double u[3] = {width * cos(yaw), 0, -width * sin(yaw)};
    double v[3] = {-length * sin(yaw) * cos(tilt), length * sin(tilt),
                   -length * cos(yaw) * cos(tilt)};
    *pane = (struct closed_form_pane){.is_blend = index % 2};
    for (int i = 0; i < 3; i++) {
        pane->u[i] = u[i];
        pane->v[i] = v[i] + shear * u[i];
        pane->corner[i] = center[i] - 0.5 * (pane->u[i] + pane->v[i]);
        pane->color[i] = closed_form_random(state, 0.05, 1);
    }
    pane->color[3] = pane->is_blend ? closed_form_random(state, 0.1, 0.9) : 1;
}

static void add_smoke(struct glb_builder *builder)
{
    enum { SIDE = 24 };
    const double radius = 0.8, height = 0.9;
    static float values[SIDE * SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
        const int place[3] = {i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE};
        double square = 0;
        for (int k = 0; k < 3; k++)
            square += pow((place[k] + 0.5) / SIDE * 2 - 1, 2);
        values[i] = (float)fmax(1 - square, 0);
    }
    int grid = glb_builder_add_grid(
        builder, &(struct glb_grid_desc){.name = "Smoke",
                                         .size = {SIDE, SIDE, SIDE},
                                         .values = values,
                                         .low = {-radius, height - radius, -radius},
                                         .high = {radius, height + radius, radius},
                                         .density = 1.5,
                                         .color = {0.9, 0.8, 0.7},
                                         .anisotropy = 0.2});
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Smoke", .grid = grid});
}

void random_panes_scene_build(const struct random_panes_scene_desc *desc,
                              struct closed_form_scene *scene)
{
    uint64_t state = desc->seed;
    struct glb_builder *builder = closed_form_begin(scene, "Random panes", desc->pane_count);
    closed_form_camera_onto(builder, "Floor", (double[]){0, 0.9, 0}, (double[]){0, 0, 0}, 2.5);
    closed_form_floor(scene, builder, 3);
    for (int k = 0; k < desc->pane_count; k++) {
        random_pane(&state, k, &scene->panes[k]);
        closed_form_add_pane(builder, &scene->panes[k]);
    }
    if (desc->has_smoke)
        add_smoke(builder);
    scene->light =
        (struct closed_form_light){.type = desc->light,
                                   .position = {0.4, 7, -0.3},
                                   .direction = {0, -1, 0},
                                   .intensity = desc->light == GLB_LIGHT_DIRECTIONAL ? 4 : 200};
    closed_form_add_light(scene, builder);
    closed_form_end(scene, builder);
}

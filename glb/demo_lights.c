/* SPDX-License-Identifier: MIT */
/* The lights through the windows, the light on the vessel, and the cameras of the demo scene. */
#include <math.h>
#include <stdio.h>

#include "glb/demo_internal.h"

static const double pi = 3.14159265358979323846;

void demo_add_light(struct demo *demo, int parent, const struct demo_light *light)
{
    struct glb_light_desc desc = {.name = light->name,
                                  .type = light->type,
                                  .color = {light->color[0], light->color[1], light->color[2]},
                                  .intensity = light->intensity * demo->light_factor,
                                  .range = light->range,
                                  .inner_cone_deg = light->inner_deg,
                                  .outer_cone_deg = light->outer_deg};
    struct glb_node_desc node = {.name = light->name, .parent = parent};
    node.light = glb_builder_add_light(demo->builder, &desc);
    if (light->type == GLB_LIGHT_POINT)
        for (int i = 0; i < 3; i++)
            node.translation[i] = light->eye[i];
    else
        glb_node_look_at(&node, light->eye, light->target);
    glb_builder_add_node(demo->builder, &node);
}

/* A low sun behind the rose: its picture lies along the nave, from the benches to the curtains. */
static void add_rose_beam(struct demo *demo, int parent)
{
    static const double rose[3] = {0, ROSE_Y, -NAVE_HALF_LENGTH - WALL_THICKNESS / 2};
    static const double pool[3] = {-1.45, 0, -0.5};
    struct demo_light beam = {.name = "Sun through the rose",
                              .type = GLB_LIGHT_SPOT,
                              .color = {1, 0.93, 0.82},
                              .intensity = 17000,
                              .inner_deg = 4.6,
                              .outer_deg = 5.4};
    for (int i = 0; i < 3; i++) {
        beam.eye[i] = rose[i] - 2.6 * (pool[i] - rose[i]);
        beam.target[i] = rose[i];
    }
    demo_add_light(demo, parent, &beam);
}

/* Four steeper beams through the side windows, onto the right half of the nave. */
static void add_lancet_beams(struct demo *demo, int parent)
{
    double elevation = 40 * pi / 180, azimuth = 14 * pi / 180, distance = 18;
    double middle_y = (LANCET_BOTTOM + LANCET_SPRING + 1.05) / 2;
    for (int bay = 0; bay < 4; bay++) {
        char name[64];
        snprintf(name, sizeof name, "Sun through lancet %d", bay + 1);
        double target[3] = {NAVE_HALF_WIDTH + WALL_THICKNESS / 2, middle_y, demo_bay_z(bay)};
        struct demo_light beam = {.name = name,
                                  .type = GLB_LIGHT_SPOT,
                                  .eye = {target[0] + distance * cos(elevation) * cos(azimuth),
                                          target[1] + distance * sin(elevation),
                                          target[2] - distance * cos(elevation) * sin(azimuth)},
                                  .target = {target[0], target[1], target[2]},
                                  .color = {1, 0.95, 0.87},
                                  .intensity = 2600,
                                  .inner_deg = 5.4,
                                  .outer_deg = 6.2};
        demo_add_light(demo, parent, &beam);
    }
}

void demo_add_lights(struct demo *demo)
{
    int parent = demo_add_group(demo, "Lights");
    add_rose_beam(demo, parent);
    add_lancet_beams(demo, parent);
    demo_add_light(demo, parent,
                   &(struct demo_light){.name = "Vessel spot",
                                        .type = GLB_LIGHT_SPOT,
                                        .eye = {2.6, 4.9, 0.4},
                                        .target = {1.65, 1.2, 2.2},
                                        .color = {1, 0.90, 0.76},
                                        .intensity = 55,
                                        .inner_deg = 8,
                                        .outer_deg = 15});
    demo_add_light(demo, parent,
                   &(struct demo_light){.name = "Door light",
                                        .type = GLB_LIGHT_SPOT,
                                        .eye = {1.5, 4.3, 9.2},
                                        .target = {-1.6, 2.2, -3},
                                        .color = {0.74, 0.84, 1},
                                        .intensity = 85,
                                        .inner_deg = 10,
                                        .outer_deg = 46});
}

static void add_camera(struct demo *demo, const char *name, double fov_y_deg, const double eye[3],
                       const double target[3])
{
    struct glb_node_desc node = {.name = name};
    node.camera = glb_builder_add_camera(
        demo->builder, &(struct glb_camera_desc){.name = name, .fov_y_deg = fov_y_deg});
    glb_node_look_at(&node, eye, target);
    glb_builder_add_node(demo->builder, &node);
}

void demo_add_cameras(struct demo *demo)
{
    add_camera(demo, "Nave", 52, (double[]){1.0, 1.75, 6.6}, (double[]){-0.45, 2.95, -10});
    add_camera(demo, "Vessel", 36, (double[]){2.75, 1.75, 3.75}, (double[]){1.50, 1.20, 2.2});
}

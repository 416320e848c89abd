/* SPDX-License-Identifier: MIT */
/* A room with spheres and many small lights: the scene of the light-list tests. */
#include <math.h>
#include <stdio.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_internal.h"

enum { SPHERE_COUNT = 40 };

static void add_walls(struct glb_builder *builder, int material)
{
    static const double quads[6][3][3] = {
        {{-8, 0, 11}, {16, 0, 0}, {0, 0, -22}}, /* floor */
        {{-8, 6, -11}, {16, 0, 0}, {0, 0, 22}}, /* ceiling */
        {{-8, 0, -11}, {16, 0, 0}, {0, 6, 0}},  /* back */
        {{8, 0, 11}, {-16, 0, 0}, {0, 6, 0}},   /* front */
        {{-8, 0, 11}, {0, 0, -22}, {0, 6, 0}},  /* left */
        {{8, 0, -11}, {0, 0, 22}, {0, 6, 0}},   /* right */
    };
    for (int i = 0; i < 6; i++)
        closed_form_quad(builder, "Wall", material, quads[i][0], quads[i][1], quads[i][2]);
}

static void add_spheres(struct glb_builder *builder, uint64_t *state, int glass_count)
{
    struct shape shape = {0};
    for (int i = 0; i < SPHERE_COUNT; i++) {
        struct glb_material_desc material = {.name = "Sphere", .roughness = 0.6};
        for (int c = 0; c < 3; c++)
            material.base_color[c] = closed_form_random(state, 0.2, 0.9);
        material.base_color[3] = 1;
        if (i < glass_count) {
            material.transmission = 1;
            material.has_ior = true;
            material.ior = 1;
            material.is_double_sided = true;
        }
        double radius = closed_form_random(state, 0.3, 0.9);
        struct glb_node_desc node = {.name = "Sphere"};
        node.translation[0] = closed_form_random(state, -7, 7);
        node.translation[1] = closed_form_random(state, radius, 4.5);
        node.translation[2] = closed_form_random(state, -10, 7);
        shape_add_sphere(&shape, (double[]){0, 0, 0}, radius, 32, 20);
        node.mesh = shape_give_mesh(&shape, builder, "Sphere",
                                    glb_builder_add_material(builder, &material));
        glb_builder_add_node(builder, &node);
    }
}

static void add_lights(struct glb_builder *builder, uint64_t *state, int count)
{
    for (int i = 0; i < count; i++) {
        char name[32];
        snprintf(name, sizeof name, "Light %d", i);
        bool is_spot = i % 2;
        double range =
            is_spot ? closed_form_random(state, 3, 6) : closed_form_random(state, 1, 2.5);
        double outer_deg = closed_form_random(state, 20, 40);
        double eye[3] = {closed_form_random(state, -7.5, 7.5), closed_form_random(state, 0.5, 5.5),
                         closed_form_random(state, -10.5, 9.5)};
        double target[3] = {eye[0] + closed_form_random(state, -1, 1), eye[1] - 1,
                            eye[2] + closed_form_random(state, -1, 1)};
        struct glb_light_desc light = {.name = name,
                                       .type = is_spot ? GLB_LIGHT_SPOT : GLB_LIGHT_POINT,
                                       .color = {closed_form_random(state, 0.3, 1),
                                                 closed_form_random(state, 0.3, 1),
                                                 closed_form_random(state, 0.3, 1)},
                                       .intensity = 1.5 * range * range,
                                       .range = range,
                                       .inner_cone_deg = is_spot ? 0.7 * outer_deg : 0,
                                       .outer_cone_deg = is_spot ? outer_deg : 0};
        struct glb_node_desc node = {.name = name};
        node.light = glb_builder_add_light(builder, &light);
        glb_node_look_at(&node, eye, target);
        glb_builder_add_node(builder, &node);
    }
}

void room_scene_build(const struct room_scene_desc *desc, struct closed_form_scene *scene)
{
    uint64_t state = desc->seed;
    struct glb_builder *builder = closed_form_begin(scene, "Room", 0);
    closed_form_camera(builder, "Room", (double[]){0, 2.6, 10.2}, (double[]){0, 2.6, 0}, 60);
    add_walls(builder, closed_form_receiver(scene, builder));
    add_spheres(builder, &state, desc->glass_spheres);
    add_lights(builder, &state, desc->light_count);
    closed_form_end(scene, builder);
}

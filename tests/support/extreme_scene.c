/* SPDX-License-Identifier: MIT */
/* The scene of the tests of extremes. */
#include "tests/support/extreme_scene.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "renderer/base/matrix.h"
#include "tests/support/image_checks.h"

static const double degree = 0.017453292519943295;

static double scale_of(const struct extreme_desc *desc)
{
    return desc->scale > 0 ? desc->scale : 1;
}

static void unit_axis(const struct extreme_desc *desc, double axis[3])
{
    memcpy(axis, desc->turn_axis, sizeof desc->turn_axis);
    if (!vec3_normalize(axis))
        memcpy(axis, (double[]){0, 1, 0}, 3 * sizeof *axis);
}

/* Rodrigues' formula. */
void extreme_turn(const struct extreme_desc *desc, const double local[3], double world[3])
{
    double axis[3], across[3], c = cos(desc->turn_deg * degree), s = sin(desc->turn_deg * degree);
    unit_axis(desc, axis);
    vec3_cross(axis, local, across);
    double along = vec3_dot(axis, local) * (1 - c);
    for (int k = 0; k < 3; k++)
        world[k] = c * local[k] + s * across[k] + along * axis[k];
}

void extreme_place(const struct extreme_desc *desc, const double local[3], double world[3])
{
    extreme_turn(desc, local, world);
    for (int k = 0; k < 3; k++)
        world[k] = desc->place[k] + scale_of(desc) * world[k];
}

struct builder {
    struct glb_builder *glb;
    const struct extreme_desc *desc;
    int root;
};

static int add_material(const struct builder *b, const double color[4], bool is_glass)
{
    struct glb_material_desc material = {.roughness = is_glass ? 0.2 : 0.9,
                                         .transmission = is_glass ? 1 : 0,
                                         .alpha_mode = color[3] < 1 ? GLB_BLEND : GLB_OPAQUE,
                                         .is_double_sided = true};
    for (int k = 0; k < 3; k++)
        material.base_color[(k + b->desc->channels) % 3] = color[k];
    material.base_color[3] = color[3];
    return glb_builder_add_material(b->glb, &material);
}

static void add_shape(const struct builder *b, struct shape *shape, const double color[4],
                      bool is_glass)
{
    struct glb_node_desc node = {
        .parent = b->root,
        .mesh = shape_give_mesh(shape, b->glb, "Shape", add_material(b, color, is_glass))};
    glb_builder_add_node(b->glb, &node);
}

static void add_pane(const struct builder *b, double height, double x, const double color[4])
{
    struct shape pane = {0};
    bool is_glass = color[3] >= 1;
    shape_add_quad(&pane, (double[]){x - 0.55, height, 0.5}, (double[]){1.1, 0.1, 0},
                   (double[]){0, 0.15, -1.1});
    add_shape(b, &pane, color, is_glass);
}

/* The second pane of the stack, whole or as two halves of its filter in one plane. */
static void add_divided_pane(const struct builder *b, double height, const double color[4])
{
    double half[4] = {sqrt(color[0]), sqrt(color[1]), sqrt(color[2]), 1};
    for (int i = 0; i < 2 && b->desc->halves_pane; i++)
        add_pane(b, height + 0.01 * i, -0.35, half);
    if (!b->desc->halves_pane)
        add_pane(b, height, -0.35, color);
}

static void add_comb(const struct builder *b)
{
    static const double metal[4] = {0.6, 0.55, 0.5, 1};
    struct shape comb = {0};
    for (int i = 0; i < 24; i++) {
        double x = 0.6 + 0.002 * i;
        shape_add_box(&comb, (double[]){x, 0.02, 0.7}, (double[]){x + 0.001, 0.03, 0.701});
    }
    add_shape(b, &comb, metal, false);
}

static void add_content(const struct builder *b)
{
    static const double white[4] = {0.8, 0.7, 0.75, 1}, wood[4] = {0.5, 0.3, 0.2, 1};
    static const double red[4] = {0.9, 0.3, 0.2, 1}, green[4] = {0.25, 0.81, 0.36, 1};
    static const double cloth[4] = {0.2, 0.3, 0.9, 0.6}, amber[4] = {0.9, 0.7, 0.3, 1};
    bool swaps = b->desc->swaps_panes;
    struct shape floor = {0}, box = {0}, ball = {0};
    shape_add_quad(&floor, (double[]){-2, 0, 2}, (double[]){4, 0, 0}, (double[]){0, 0, -4});
    add_shape(b, &floor, white, false);
    shape_add_box(&box, (double[]){0.3, 0, -0.9}, (double[]){0.8, 0.7, -0.4});
    add_shape(b, &box, wood, false);
    shape_add_sphere(&ball, (double[]){0.9, 0.4, 0.25}, 0.25, 24, 16);
    add_shape(b, &ball, amber, true);
    add_pane(b, 0.9, -0.35, swaps ? green : red);
    add_divided_pane(b, 1.2, swaps ? red : green);
    add_pane(b, 0.6, 0.1, cloth);
    add_comb(b);
}

static void make_glb(const struct extreme_desc *desc, void **bytes, size_t *size)
{
    struct error err = {0};
    struct builder b = {.glb = glb_builder_create("Extremes", &err), .desc = desc};
    assert_non_null(b.glb);
    double s = desc->is_edited ? 1 : scale_of(desc);
    struct glb_node_desc root = {.name = "Root", .scale = {s, s, s}};
    if (!desc->is_edited) {
        double axis[3];
        unit_axis(desc, axis);
        memcpy(root.translation, desc->place, sizeof root.translation);
        glb_node_rotate(&root, axis, desc->turn_deg);
    }
    b.root = glb_builder_add_node(b.glb, &root);
    add_content(&b);
    if (desc->extend)
        desc->extend(b.glb, b.root, desc->context);
    if (!glb_builder_finish(b.glb, bytes, size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(b.glb);
}

static void set_lights(struct extreme_scene *scene, const struct extreme_desc *desc)
{
    static const struct view_light lights[EXTREME_LIGHTS] = {
        {.type = SCENE_LIGHT_POINT,
         .position = {0.4, 2.6, 0.5},
         .direction = {0, -1, 0}, /* of its map's cube */
         .color = {1, 0.9, 0.8},
         .intensity = 8,
         .range = 9},
        {.type = SCENE_LIGHT_SPOT,
         .position = {-1.6, 3, 1.1},
         .direction = {0.4, -0.8, -0.3},
         .color = {0.8, 0.9, 1},
         .intensity = 20,
         .inner_cone_deg = 20,
         .outer_cone_deg = 40},
        {.type = SCENE_LIGHT_DIRECTIONAL,
         .direction = {0.3, -1, -0.2},
         .color = {1, 0.8, 1},
         .intensity = 1.5f},
    };
    float s = (float)scale_of(desc);
    for (int i = 0; i < EXTREME_LIGHTS; i++) {
        struct view_light *light = &scene->lights[i];
        *light = lights[i];
        extreme_place(desc, lights[i].position, light->position);
        extreme_turn(desc, lights[i].direction, light->direction);
        if (desc->has_up)
            extreme_turn(desc, (double[]){0, 0, 1}, light->up);
        light->range *= s;
        for (int k = 0; k < 3; k++)
            light->color[(k + desc->channels) % 3] = lights[i].color[k];
        if (light->type != SCENE_LIGHT_DIRECTIONAL)
            light->intensity *= s * s;
    }
}

static void edit_root(struct extreme_scene *scene, const struct extreme_desc *desc)
{
    struct view_node_override *root = &scene->root;
    *root = (struct view_node_override){.node = "Root", .has_matrix = true};
    for (int k = 0; k < 3; k++) {
        double axis[3] = {k == 0, k == 1, k == 2}, turned[3];
        extreme_turn(desc, axis, turned);
        for (int i = 0; i < 3; i++)
            root->matrix[4 * k + i] = turned[i] * scale_of(desc);
        root->matrix[12 + k] = desc->place[k];
    }
    root->matrix[15] = 1;
    scene->view.nodes = root;
    scene->view.node_override_count = 1;
}

void extreme_scene_open(struct extreme_scene *scene, struct renderer *renderer, const char *key,
                        const struct extreme_desc *desc)
{
    static const double eyes[2][3] = {{-1.1, 1.5, 2.6}, {0.63, 0.05, 0.79}};
    static const double targets[2][3] = {{0.1, 0.45, 0}, {0.63, 0.02, 0.7}};
    void *bytes;
    size_t size;
    *scene = (struct extreme_scene){0};
    make_glb(desc, &bytes, &size);
    rig_scene_open(&scene->rig, renderer, key, bytes, size);
    free(bytes);
    set_lights(scene, desc);
    scene->view = (struct view){.width_px = 160,
                                .height_px = 120,
                                .camera = {.kind = VIEW_CAMERA_LOOK_AT, .fov_y_deg = 42},
                                .lights = scene->lights,
                                .light_count = EXTREME_LIGHTS,
                                .quality = {.shadow_resolution = 512}};
    extreme_turn(desc, (double[]){0, 1, 0}, scene->view.camera.up);
    extreme_place(desc, eyes[desc->has_detail], scene->view.camera.eye);
    extreme_place(desc, targets[desc->has_detail], scene->view.camera.target);
    if (desc->is_edited)
        edit_root(scene, desc);
}

void extreme_scene_finish(struct extreme_scene *scene, struct renderer *renderer)
{
    rig_scene_finish(&scene->rig, renderer);
}

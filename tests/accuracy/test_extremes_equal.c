/* SPDX-License-Identifier: MIT */
/* Changes that must not change the picture: filters that change places or are split, a turned
 * scene, swapped colour channels. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/extreme_scene.h"
#include "tests/support/image_checks.h"

static const struct technique {
    const char *name;
    enum shadow_technique shadows;
} techniques[] = {
    {"deep", SHADOWS_DEEP},
    {"deep-linked", SHADOWS_DEEP_LINKED},
    {"raytraced", SHADOWS_RAYTRACED},
};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

static struct image picture_of(struct renderer *renderer, const struct extreme_desc *desc,
                               const struct technique *technique)
{
    struct extreme_scene scene;
    extreme_scene_open(&scene, renderer, "equal", desc);
    scene.view.quality.shadows = technique->shadows;
    struct image picture = shoot_color(renderer, &scene.rig, &scene.view);
    assert_image_is_sound(&picture, 1e6);
    extreme_scene_finish(&scene, renderer);
    return picture;
}

static void colour_channels_do_not_know_of_each_other(void **state)
{
    for (int t = 0; t < TECHNIQUES; t++) {
        struct image plain = picture_of(*state, &(struct extreme_desc){0}, &techniques[t]);
        for (int shift = 1; shift < 3; shift++) {
            struct image moved =
                picture_of(*state, &(struct extreme_desc){.channels = shift}, &techniques[t]);
            int differing = 0;
            for (int y = 0; y < plain.height_px; y++)
                for (int x = 0; x < plain.width_px; x++)
                    for (int k = 0; k < 3; k++)
                        differing += image_pixel_f32(&plain, x, y)[k] !=
                                     image_pixel_f32(&moved, x, y)[(k + shift) % 3];
            extreme_expect(&(struct extreme_row){shift == 1 ? "channels r g b as g b r"
                                                            : "channels r g b as b r g",
                                                 techniques[t].name, "values of other bits", 0},
                           differing);
            image_finish(&moved);
        }
        image_finish(&plain);
    }
}

static const struct extreme_desc turned[] = {
    {.has_up = true, .turn_deg = 90},
    {.has_up = true, .turn_deg = 180},
    {.has_up = true, .turn_deg = 37},
    {.has_up = true, .turn_deg = 111.7, .turn_axis = {1, 2, 3}},
};
enum { TURNS = sizeof turned / sizeof *turned };

/* The scene, its lights and its camera, turned together, the texels of their maps with them: seen
 * from the camera and from each light, nothing has moved. */
static void a_turned_scene_gives_the_same_picture(void **state)
{
    for (int t = 0; t < TECHNIQUES; t++) {
        double worst = 0;
        struct image straight =
            picture_of(*state, &(struct extreme_desc){.has_up = true}, &techniques[t]);
        for (int i = 0; i < TURNS; i++) {
            struct image picture = picture_of(*state, &turned[i], &techniques[t]);
            double rmse = extreme_rmse(&picture, &straight);
            print_message("%s, turned by %g degrees: %.3g\n", techniques[t].name,
                          turned[i].turn_deg, rmse);
            worst = fmax(worst, rmse);
            image_finish(&picture);
        }
        image_finish(&straight);
        extreme_expect(&(struct extreme_row){"a scene turned with its lights and camera",
                                             techniques[t].name, "RMSE, relative", 1e-6},
                       worst);
    }
}

enum { KIND_ONE_SAMPLE, KIND_ORTHOGRAPHIC, KIND_CUT, KIND_FAR_LAMP, KIND_FAR_CUBE, KINDS };

static struct image picture_of_kind(struct renderer *renderer, const struct extreme_desc *desc,
                                    int kind)
{
    struct extreme_scene scene;
    extreme_scene_open(&scene, renderer, "equal", desc);
    struct view *view = &scene.view;
    double scale = desc->scale > 0 ? desc->scale : 1, plane[1][4], on_plane[3];
    view->quality.samples = kind == KIND_ONE_SAMPLE ? 1 : 4;
    if (kind == KIND_ORTHOGRAPHIC)
        view->camera.ortho_height = 3 * scale;
    if (kind == KIND_CUT) {
        extreme_turn(desc, (double[]){0.8, 0.36, 0.48}, plane[0]);
        extreme_place(desc, (double[]){-0.1, 0, 0}, on_plane);
        plane[0][3] = -vec3_dot(plane[0], on_plane);
        view->clip_planes = (const double(*)[4])plane;
        view->clip_plane_count = 1;
    }
    if (kind == KIND_FAR_LAMP || kind == KIND_FAR_CUBE) { /* the point light alone */
        double far = kind == KIND_FAR_LAMP ? 60 : 7;
        extreme_place(desc, (double[]){0.3 * far, far, 0.2 * far}, scene.lights[0].position);
        scene.lights[0].intensity *= (float)(far * far);
        scene.lights[0].range = 0;
        view->light_count = 1;
    }
    struct image picture = shoot_color(renderer, &scene.rig, view);
    assert_image_is_sound(&picture, 1e6);
    extreme_scene_finish(&scene, renderer);
    return picture;
}

/* One sample, no perspective, a clip plane, lamps far from all that casts: whatever else has a
 * place or a direction. */
static void turned_and_scaled_views_of_all_kinds_give_the_same_picture(void **state)
{
    static const char *const names[KINDS] = {"one sample", "orthographic", "a clip plane",
                                             "a lamp at 60 m", "a lamp at 7 m"};
    static const struct extreme_desc scaled = {.has_up = true, .scale = 1e3};
    for (int kind = 0; kind < KINDS; kind++) {
        char scene[64];
        struct image straight =
            picture_of_kind(*state, &(struct extreme_desc){.has_up = true}, kind);
        struct image by_turn = picture_of_kind(*state, &turned[TURNS - 1], kind);
        struct image by_scale = picture_of_kind(*state, &scaled, kind);
        snprintf(scene, sizeof scene, "turned, %s", names[kind]);
        extreme_expect(&(struct extreme_row){scene, "deep", "RMSE, relative", 1e-6},
                       extreme_rmse(&by_turn, &straight));
        snprintf(scene, sizeof scene, "scaled by 1000, %s", names[kind]);
        extreme_expect(&(struct extreme_row){scene, "deep", "RMSE, relative", 1e-5},
                       extreme_rmse(&by_scale, &straight));
        image_finish(&straight);
        image_finish(&by_turn);
        image_finish(&by_scale);
    }
}

static void add_lamp(struct glb_builder *b, int root, const struct glb_light_desc *desc,
                     const double eye[3], const double target[3])
{
    struct glb_node_desc node = {
        .name = "Lamp", .parent = root, .light = glb_builder_add_light(b, desc)};
    glb_node_look_at(&node, eye, target);
    glb_builder_add_node(b, &node);
}

static void add_lamps(struct glb_builder *b, int root, void *context)
{
    const bool *has = context;
    if (has[0])
        add_lamp(b, root,
                 &(struct glb_light_desc){.type = GLB_LIGHT_SPOT,
                                          .intensity = 20,
                                          .inner_cone_deg = 20,
                                          .outer_cone_deg = 40},
                 (double[]){-1.6, 3, 1.1}, (double[]){0, 0.2, 0});
    if (has[1])
        add_lamp(b, root, &(struct glb_light_desc){.type = GLB_LIGHT_POINT, .intensity = 8},
                 (double[]){0.4, 2.6, 0.5}, (double[]){0.3, 0, 0.1});
    if (has[2])
        add_lamp(b, root, &(struct glb_light_desc){.type = GLB_LIGHT_DIRECTIONAL, .intensity = 1.5},
                 (double[]){1, 4, 2}, (double[]){0.2, 0, 0.3});
}

/* Lights of nodes: nothing has to be said. */
static void texels_turn_with_the_node_of_their_light(void **state)
{
    static const char *const names[] = {"a spot of a node, turned", "a point of a node, turned",
                                        "a sun of a node, turned"};
    for (int lamp = 0; lamp < 3; lamp++) {
        bool has[3] = {lamp == 0, lamp == 1, lamp == 2};
        struct image pictures[2];
        for (int i = 0; i < 2; i++) {
            struct extreme_desc desc = {.turn_deg = i * 37.0, .extend = add_lamps, .context = has};
            struct extreme_scene scene;
            extreme_scene_open(&scene, *state, "turned", &desc);
            scene.view.light_count = 0;
            pictures[i] = shoot_color(*state, &scene.rig, &scene.view);
            assert_image_is_sound(&pictures[i], 1e6);
            extreme_scene_finish(&scene, *state);
        }
        extreme_expect(&(struct extreme_row){names[lamp], "deep", "RMSE, relative", 1e-6},
                       extreme_rmse(&pictures[1], &pictures[0]));
        image_finish(&pictures[0]);
        image_finish(&pictures[1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colour_channels_do_not_know_of_each_other),
        cmocka_unit_test(a_turned_scene_gives_the_same_picture),
        cmocka_unit_test(turned_and_scaled_views_of_all_kinds_give_the_same_picture),
        cmocka_unit_test(texels_turn_with_the_node_of_their_light),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

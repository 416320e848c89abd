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

#include "tests/support/extreme_checks.h"
#include "tests/support/extreme_scene.h"
#include "tests/support/image_checks.h"

static const struct technique {
    const char *name;
    enum view_shadows shadows;
} techniques[] = {
    {"deep", VIEW_SHADOWS_DEEP},
    {"deep-linked", VIEW_SHADOWS_DEEP_LINKED},
    {"raytraced", VIEW_SHADOWS_RAYTRACED},
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

/* The scene, its lights and its camera, turned together, the texels of their maps with them: seen
 * from the camera and from each light, nothing has moved. */
static void a_turned_scene_gives_the_same_picture(void **state)
{
    static const double turns[] = {90, 180, 37, 111.7};
    for (int t = 0; t < TECHNIQUES; t++) {
        double worst = 0;
        struct image straight =
            picture_of(*state, &(struct extreme_desc){.has_up = true}, &techniques[t]);
        for (size_t i = 0; i < sizeof turns / sizeof *turns; i++) {
            struct image turned =
                picture_of(*state, &(struct extreme_desc){.turn_deg = turns[i], .has_up = true},
                           &techniques[t]);
            double rmse = extreme_rmse(&turned, &straight);
            print_message("%s, turned by %g degrees: %.3g\n", techniques[t].name, turns[i], rmse);
            worst = fmax(worst, rmse);
            image_finish(&turned);
        }
        image_finish(&straight);
        extreme_expect(&(struct extreme_row){"a scene turned with its lights and camera",
                                             techniques[t].name, "RMSE, relative", 1e-6},
                       worst);
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
        cmocka_unit_test(texels_turn_with_the_node_of_their_light),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

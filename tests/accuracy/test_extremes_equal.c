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

/* The scene, its lights and its camera, turned together. A map's texels turn with a light's own
 * axes or stay with the world's: edges of shadows move within their texel. */
static void a_turned_scene_gives_the_same_picture(void **state)
{
    static const double turns[] = {90, 180, 37};
    for (int t = 0; t < TECHNIQUES; t++) {
        bool is_raster = techniques[t].shadows != VIEW_SHADOWS_RAYTRACED;
        double worst = 0;
        struct image straight = picture_of(*state, &(struct extreme_desc){0}, &techniques[t]);
        for (size_t i = 0; i < sizeof turns / sizeof *turns; i++) {
            struct image turned =
                picture_of(*state, &(struct extreme_desc){.turn_deg = turns[i]}, &techniques[t]);
            double rmse = extreme_rmse(&turned, &straight);
            print_message("%s, turned by %g degrees: %.3g\n", techniques[t].name, turns[i], rmse);
            worst = fmax(worst, rmse);
            image_finish(&turned);
        }
        image_finish(&straight);
        extreme_expect(&(struct extreme_row){"a scene turned with its lights and camera",
                                             techniques[t].name, "RMSE, relative",
                                             is_raster ? 3e-2 : 1e-4},
                       worst);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colour_channels_do_not_know_of_each_other),
        cmocka_unit_test(a_turned_scene_gives_the_same_picture),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Where a scene stands, how large it is and which way it looks does not show in its picture. */
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

static struct image picture_of(struct renderer *renderer, const struct extreme_desc *desc,
                               enum shadow_technique shadows, const char *name)
{
    struct extreme_scene scene;
    extreme_scene_open(&scene, renderer, "place", desc);
    scene.view.quality.shadows = shadows;
    struct image picture = shoot_color(renderer, &scene.rig, &scene.view);
    assert_image_is_sound(&picture, 1e6);
    if (name)
        save_picture(&picture, name);
    extreme_scene_finish(&scene, renderer);
    return picture;
}

static const struct technique {
    const char *name;
    enum shadow_technique shadows;
} techniques[] = {
    {"deep", SHADOWS_DEEP},
    {"deep-linked", SHADOWS_DEEP_LINKED},
    {"raytraced", SHADOWS_RAYTRACED},
};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

static void ten_million_metres_away_the_picture_is_the_same(void **state)
{
    for (int t = 0; t < TECHNIQUES; t++) {
        for (int is_near = 0; is_near < 2; is_near++) {
            char name[64];
            struct extreme_desc here = {.has_detail = is_near};
            struct extreme_desc there = {.has_detail = is_near, .place = {1e7, -1e7, 1e7}};
            snprintf(name, sizeof name, "extreme_%s_%d", techniques[t].name, is_near);
            struct image a = picture_of(*state, &here, techniques[t].shadows, name);
            struct image b = picture_of(*state, &there, techniques[t].shadows, NULL);
            extreme_expect(&(struct extreme_row){is_near ? "1 mm teeth at 1e7 m, seen from 0.1 m"
                                                         : "a room at 1e7 m",
                                                 techniques[t].name, "RMSE, relative", 1e-5},
                           extreme_rmse(&b, &a));
            image_finish(&a);
            image_finish(&b);
        }
    }
}

/* Powers of two round as 1 does: whatever is left is an absolute length somewhere, and there is
 * none. */
static void powers_of_two_from_1e_minus_6_to_1e6_give_the_same_picture(void **state)
{
    for (int t = 0; t < TECHNIQUES; t++) {
        double worst = 0;
        struct extreme_desc desc = {0};
        struct image one = picture_of(*state, &desc, techniques[t].shadows, NULL);
        for (int step = -6; step <= 6; step++) {
            desc.scale = exp2(round(step * log2(10)));
            struct image other = picture_of(*state, &desc, techniques[t].shadows, NULL);
            double rmse = extreme_rmse(&other, &one);
            print_message("%s, %g m: %.3g\n", techniques[t].name, desc.scale, rmse);
            worst = fmax(worst, rmse);
            image_finish(&other);
        }
        image_finish(&one);
        extreme_expect(&(struct extreme_row){"13 scales of 2^-20 to 2^20", techniques[t].name,
                                             "RMSE, relative", 1e-5},
                       worst);
    }
}

/* Share of pixels whose largest channel is off by more than 1e-3 of its value. */
static double share_differing(const struct image *a, const struct image *b)
{
    int differing = 0;
    for (int y = 0; y < a->height_px; y++) {
        for (int x = 0; x < a->width_px; x++) {
            const float *p = image_pixel_f32(a, x, y), *q = image_pixel_f32(b, x, y);
            bool differs = false;
            for (int k = 0; k < 3; k++)
                differs |= !(fabsf(p[k] - q[k]) <= 1e-3f * fmaxf(p[k], 1e-3f));
            differing += differs;
        }
    }
    return (double)differing / (a->width_px * a->height_px);
}

/* Rasterisers snap vertices to 1/256 of a pixel or texel, so that an edge moves by as much where a
 * vertex is rounded anew: what draws has to be the same to the bit. Only lengths in metres may
 * round. */
static void check_powers_of_ten(struct renderer *renderer, bool is_edited)
{
    const char *scene =
        is_edited ? "13 scales of 1e-6 to 1e6, by an edit" : "13 scales of 1e-6 to 1e6";
    for (int t = 0; t < TECHNIQUES; t++) {
        double worst = 0, share = 0;
        struct extreme_desc desc = {0};
        struct image one = picture_of(renderer, &desc, techniques[t].shadows, NULL);
        for (int exponent = -6; exponent <= 6; exponent++) {
            desc.scale = pow(10, exponent);
            desc.is_edited = is_edited;
            struct image other = picture_of(renderer, &desc, techniques[t].shadows, NULL);
            worst = fmax(worst, extreme_rmse(&other, &one));
            share = fmax(share, share_differing(&other, &one));
            image_finish(&other);
        }
        image_finish(&one);
        extreme_expect(&(struct extreme_row){scene, techniques[t].name, "RMSE, relative", 1e-5},
                       worst);
        extreme_expect(
            &(struct extreme_row){scene, techniques[t].name, "share of pixels off by 1e-3", 0},
            share);
    }
}

static void powers_of_ten_from_1e_minus_6_to_1e6_give_the_same_picture(void **state)
{
    check_powers_of_ten(*state, false);
}

/* Nor does it matter whether the file or an edit of the view says so. */
static void powers_of_ten_by_an_edit_give_the_same_picture(void **state)
{
    check_powers_of_ten(*state, true);
}

/* Nor does it matter how the scale itself rounds: those that differ from 1 by the last bits of f32.
 */
static void a_last_bit_of_the_scale_gives_the_same_picture(void **state)
{
    static const double last_bits[] = {-1.2e-7, -6e-8, -3e-8, 3e-8, 6e-8, 1.2e-7};
    struct extreme_desc desc = {0};
    struct image one = picture_of(*state, &desc, SHADOWS_DEEP, NULL);
    double worst = 0;
    for (size_t i = 0; i < sizeof last_bits / sizeof *last_bits; i++) {
        desc.scale = 1 + last_bits[i];
        struct image other = picture_of(*state, &desc, SHADOWS_DEEP, NULL);
        worst = fmax(worst, extreme_rmse(&other, &one));
        image_finish(&other);
    }
    image_finish(&one);
    extreme_expect(
        &(struct extreme_row){"scales of 1 +- 3e-8 to 1.2e-7", "deep", "RMSE, relative", 1e-5},
        worst);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_million_metres_away_the_picture_is_the_same),
        cmocka_unit_test(powers_of_two_from_1e_minus_6_to_1e6_give_the_same_picture),
        cmocka_unit_test(powers_of_ten_from_1e_minus_6_to_1e6_give_the_same_picture),
        cmocka_unit_test(powers_of_ten_by_an_edit_give_the_same_picture),
        cmocka_unit_test(a_last_bit_of_the_scale_gives_the_same_picture),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

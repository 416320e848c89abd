/* SPDX-License-Identifier: MIT */
/* The smallest and the largest of everything: images, maps, pools. Correct, or refused with the
 * limit, and the next frame is served. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/extreme_checks.h"
#include "tests/support/extreme_scene.h"
#include "tests/support/image_checks.h"

struct fixture {
    struct renderer *renderer;
    struct extreme_scene scene;
};

static struct image shoot_view(const struct fixture *fixture, const struct view *view)
{
    struct image picture = shoot_color(fixture->renderer, &fixture->scene.rig, view);
    assert_image_is_sound(&picture, 1e6);
    return picture;
}

/* Every pixel of a picture of another size stands where the ray through its centre leads: an image
 * of w x h pixels is compared with the pixels of a large one that lie at the same places. */
static void check_size(const struct fixture *fixture, int width, int height, int times)
{
    struct view view = fixture->scene.view;
    char scene[64];
    view.quality.samples = 1;
    view.quality.refraction = VIEW_REFRACTION_OFF; /* it sees no farther than a picture reaches */
    view.width_px = width;
    view.height_px = height;
    struct image small = shoot_view(fixture, &view);
    view.width_px = times * width;
    view.height_px = times * height;
    struct image large = shoot_view(fixture, &view);
    long differing = 0;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) { /* odd multiples share the centres of pixels */
            const float *p = image_pixel_f32(&small, x, y);
            const float *q = image_pixel_f32(&large, times * x + times / 2, times * y + times / 2);
            for (int k = 0; k < 3; k++)
                differing += fabsf(p[k] - q[k]) > 2e-3f * fmaxf(q[k], 1e-2f);
        }
    snprintf(scene, sizeof scene, "image of %dx%d pixels against %d times that", width, height,
             times);
    extreme_expect(&(struct extreme_row){scene, "deep", "share of values off by 2e-3", 0.01},
                   (double)differing / (3.0 * width * height));
    image_finish(&small);
    image_finish(&large);
}

static void images_of_any_shape_show_the_same_scene(void **state)
{
    check_size(*state, 1, 1, 3);
    check_size(*state, 2, 1, 9);
    check_size(*state, 1, 97, 3);
    check_size(*state, 333, 5, 3);
    check_size(*state, 5461, 1, 3); /* 16,383 wide: four windows */
    check_size(*state, 1, 5461, 3);
}

static bool is_refused(const struct fixture *fixture, const struct view *view, const char *limit)
{
    struct frame frame;
    struct error err = {0};
    if (renderer_render(fixture->renderer, fixture->scene.rig.key, view, &frame, &err)) {
        frame_finish(&frame);
        return false;
    }
    print_message("refused: %s\n", err.message);
    return strstr(err.message, limit) != NULL;
}

static void images_beyond_the_limit_are_refused_by_number(void **state)
{
    const struct fixture *fixture = *state;
    static const int sides[][2] = {{16385, 1}, {1, 16385}, {0, 1}, {-1, 1}, {1 << 30, 1 << 30}};
    struct view view = fixture->scene.view;
    for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
        view.width_px = sides[i][0];
        view.height_px = sides[i][1];
        assert_true(is_refused(fixture, &view, "[1, 16384]"));
    }
    struct image after = shoot_view(fixture, &fixture->scene.view);
    image_finish(&after);
}

/* 4 GiB of pixels in 128 windows: minutes, so in the full version only. */
static void a_picture_of_16k_by_16k_pixels_is_made(void **state)
{
    const struct fixture *fixture = *state;
    struct view view = fixture->scene.view;
    double mean[2][3];
    const double whole[4] = {0, 0, 1, 1};
    if (!extreme_is_full())
        skip();
    view.quality.samples = 1;
    for (int i = 0; i < 2; i++) {
        view.width_px = view.height_px = i ? 16384 : 512;
        struct image picture = shoot_view(fixture, &view);
        image_mean(&picture, whole, mean[i]);
        image_finish(&picture);
    }
    extreme_expect(&(struct extreme_row){"image of 16384x16384 pixels against 512x512", "deep",
                                         "energy, relative", 1e-2},
                   fabs(mean[1][0] / mean[0][0] - 1));
}

/* One texel per face: the whole map is one product. Where a light sees no edge in that texel, it is
 * even right. */
static void maps_of_one_texel_are_sound(void **state)
{
    const struct fixture *fixture = *state;
    struct view view = fixture->scene.view;
    static const int taps[] = {1, 4, 9, 16};
    for (size_t i = 0; i < sizeof taps / sizeof *taps; i++) {
        for (int linked = 0; linked < 2; linked++) {
            view.quality =
                (struct view_quality){.shadow_resolution = 1,
                                      .shadow_taps = taps[i],
                                      .shadows = linked ? SHADOWS_DEEP_LINKED : SHADOWS_DEEP};
            struct image picture = shoot_view(fixture, &view);
            image_finish(&picture);
        }
    }
}

/* 16,384 texels a side are more than one table of the reference device holds: said before anything
 * is built. A device that can, must. */
static void maps_of_16k_texels_are_made_or_refused_by_number(void **state)
{
    const struct fixture *fixture = *state;
    for (int light = 0; light < EXTREME_LIGHTS; light++) {
        struct view view = fixture->scene.view;
        struct frame frame;
        struct error err = {0};
        view.lights = &fixture->scene.lights[light];
        view.light_count = 1;
        view.quality.shadow_resolution = 16384;
        if (renderer_render(fixture->renderer, fixture->scene.rig.key, &view, &frame, &err)) {
            assert_image_is_sound(&frame.outputs[VIEW_OUTPUT_COLOR], 1e6);
            frame_finish(&frame);
            continue;
        }
        print_message("light %d: %s\n", light, err.message);
        assert_int_equal(err.code, ERROR_OVER_BUDGET);
        assert_non_null(strstr(err.message, light == 0 ? "1610612736" : "268435456"));
    }
}

static int setup(void **state)
{
    static struct fixture fixture;
    fixture.renderer = render_rig_create();
    extreme_scene_open(&fixture.scene, fixture.renderer, "sizes", &(struct extreme_desc){0});
    *state = &fixture;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *fixture = *state;
    extreme_scene_finish(&fixture->scene, fixture->renderer);
    renderer_destroy(fixture->renderer);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(images_of_any_shape_show_the_same_scene),
        cmocka_unit_test(images_beyond_the_limit_are_refused_by_number),
        cmocka_unit_test(a_picture_of_16k_by_16k_pixels_is_made),
        cmocka_unit_test(maps_of_one_texel_are_sound),
        cmocka_unit_test(maps_of_16k_texels_are_made_or_refused_by_number),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

/* SPDX-License-Identifier: MIT */
/* The exposure of a view: of what is seen alone, by every technique alike. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/image/exposure.h"
#include "tests/support/image_checks.h"

/* Techniques differ by their shadows' edges, and by what they leave out: in the mean of the
 * logarithms of a picture by a twentieth of a stop at most. */
#define TECHNIQUES_EV 0.05

static struct view demo_view(void)
{
    return (struct view){
        .width_px = 160,
        .height_px = 90,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}},
        .quality = {.shadow_resolution = 64, .shadows = SHADOWS_DEEP}};
}

static struct exposure_reading meter(struct renderer *renderer, const struct rig_scene *scene,
                                     const struct view *view)
{
    struct error err = {0};
    struct exposure_reading reading;
    if (!renderer_meter(renderer, scene->key, view, &reading, &err))
        fail_msg("%s", err.message);
    return reading;
}

static void techniques_meter_alike(void **state)
{
    static const enum shadow_technique techniques[] = {SHADOWS_DEEP, SHADOWS_RAYTRACED_SHADOWS,
                                                       SHADOWS_RAYTRACED};
    struct renderer *renderer = *state;
    struct rig_scene demo;
    float first = 0;
    rig_demo_open(&demo, renderer, "demo", 64);
    for (int i = 0; i < 3; i++) {
        struct view view = demo_view();
        view.quality.shadows = techniques[i];
        struct exposure_reading reading = meter(renderer, &demo, &view);
        assert_false(reading.is_kept);
        if (i == 0)
            first = reading.ev;
        if (fabs((double)(reading.ev - first)) > TECHNIQUES_EV)
            fail_msg("technique %d meters %g, the first %g", i, (double)reading.ev, (double)first);
    }
    rig_scene_finish(&demo, renderer);
}

/* Its own log-average is at middle grey, as that of a picture of any size would be. */
static void the_picture_itself_is_exposed(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene demo;
    rig_demo_open(&demo, renderer, "demo", 64);
    struct view view = demo_view();
    view.width_px = 480;
    view.height_px = 270;
    struct exposure_reading reading = meter(renderer, &demo, &view);
    struct image image = shoot_color(renderer, &demo, &view);
    assert_true(fabs((double)(exposure_meter(&image) - reading.ev)) <= TECHNIQUES_EV);
    image_finish(&image);
    rig_scene_finish(&demo, renderer);
}

/* Exactly, and without drawing again. */
static void what_is_seen_alone_decides(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene demo;
    rig_demo_open(&demo, renderer, "demo", 64);
    struct view view = demo_view();
    float ev = meter(renderer, &demo, &view).ev;
    for (int i = 0; i < 6; i++) {
        struct view other = demo_view();
        if (i == 0)
            other.width_px *= 4, other.height_px *= 4;
        else if (i == 1)
            other.quality.samples = 4;
        else if (i == 2)
            other.background[0] = other.background[3] = 1;
        else if (i == 3)
            other.screen = (struct view_screen){.channels = 4, .has_backdrop = true};
        else if (i == 4)
            other.edges.is_drawn = true, other.edges.width_px = 3;
        else
            other.quality.may_be_coarse = true;
        struct exposure_reading reading = meter(renderer, &demo, &other);
        assert_true(reading.is_kept && reading.ev == ev);
    }
    view.camera.eye[0] = 4;
    assert_false(meter(renderer, &demo, &view).is_kept);
    rig_scene_finish(&demo, renderer);
}

/* Whatever was metered or drawn before. */
static void the_same_view_has_the_same_exposure(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene demo;
    struct view view = demo_view();
    float ev[2];
    for (int i = 0; i < 2; i++) {
        rig_demo_open(&demo, renderer, "demo", 64);
        for (int k = 0; k < 20; k++) { /* more than are kept */
            struct view other = demo_view();
            other.width_px = other.height_px = 16;
            other.camera.eye[1] = 4 + 0.01f * (float)k;
            (void)meter(renderer, &demo, &other);
        }
        struct exposure_reading reading = meter(renderer, &demo, &view);
        assert_false(reading.is_kept);
        ev[i] = reading.ev;
        rig_scene_finish(&demo, renderer);
    }
    assert_true(ev[0] == ev[1]);
}

static void nothing_in_view_needs_no_exposure(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene demo;
    struct error err = {0};
    struct exposure_reading reading;
    rig_demo_open(&demo, renderer, "demo", 64);
    struct view view = demo_view();
    view.camera.eye[1] = 4000;
    view.camera.target[1] = 5000;
    assert_true(meter(renderer, &demo, &view).ev == 0);
    view.width_px = 0;
    assert_false(renderer_meter(renderer, demo.key, &view, &reading, &err));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    rig_scene_finish(&demo, renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(techniques_meter_alike),
        cmocka_unit_test(the_picture_itself_is_exposed),
        cmocka_unit_test(what_is_seen_alone_decides),
        cmocka_unit_test(the_same_view_has_the_same_exposure),
        cmocka_unit_test(nothing_in_view_needs_no_exposure),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

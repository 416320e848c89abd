/* SPDX-License-Identifier: MIT */
/* `auto` learns from the frames that it chose for: what it expects of the next ones moves to what
 * they take, and pixels follow what is published alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

/* Rays are said to take a thousandth of what they do on the machine of the fit. */
static const struct auto_settings too_fast = {.policy = AUTO_MEASURED,
                                              .speed = {1, 1, 1, 1e-3, 1e-3}};

struct fixture {
    struct renderer *renderer;
    struct rig_scene demo;
};

static void fixture_init(struct fixture *fixture)
{
    *fixture = (struct fixture){.renderer = render_rig_create()};
    rig_demo_open(&fixture->demo, fixture->renderer, "demo", 64);
    renderer_set_auto(fixture->renderer, &too_fast);
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

static uint64_t print_of(const struct fixture *fixture)
{
    uint64_t print;
    assert_non_null(renderer_get_learned(fixture->renderer, &print));
    return print;
}

/* A frame of a camera that moves. */
static double draw(struct fixture *fixture, int step, struct frame_report *report)
{
    struct frame frame;
    struct error err = {0};
    const struct view view = {
        .width_px = 64,
        .height_px = 48,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {1, 1.75 + 0.01 * step, 6.6},
                   .target = {-0.45, 2.95, -10},
                   .fov_y_deg = 52},
        .quality = {.samples = 1, .expects_reuse = true},
    };
    if (!renderer_render(fixture->renderer, fixture->demo.key, &view, &frame, &err))
        fail_msg("%s", err.message);
    *report = frame.report;
    frame_finish(&frame);
    return report->chosen.expected_ms;
}

static void expectations_follow_what_frames_take(void **unused)
{
    (void)unused;
    struct fixture fixture;
    struct frame_report report;
    fixture_init(&fixture);
    assert_int_equal(print_of(&fixture), 0);
    double first = draw(&fixture, 0, &report); /* it may build */
    assert_true(report.chosen.is_traced);
    draw(&fixture, 1, &report);
    assert_int_equal(print_of(&fixture), 0); /* two lessons at most: nothing is published */
    double last = first;
    for (int step = 2; step < 14; step++)
        last = draw(&fixture, step, &report);
    assert_int_not_equal(print_of(&fixture), 0);
    assert_true(last > 8 * first);
    if (report.chosen.is_traced)
        assert_non_null(strstr(report.chosen.because, "like it"));
    fixture_finish(&fixture);
}

/* What one renderer has learned, another goes by; and it can be forgotten. */
static void what_was_learned_is_taken_along(void **unused)
{
    (void)unused;
    struct fixture fixture;
    struct frame_report report;
    fixture_init(&fixture);
    double first = draw(&fixture, 0, &report), last = first;
    for (int step = 1; step < 14; step++)
        last = draw(&fixture, step, &report);
    struct learning *learned = malloc(sizeof *learned);
    assert_non_null(learned);
    uint64_t print, print_again;
    *learned = *renderer_get_learned(fixture.renderer, &print);
    assert_true(learning_is_sound(learned));
    renderer_set_learned(fixture.renderer, NULL);
    assert_int_equal(print_of(&fixture), 0);
    assert_true(draw(&fixture, 0, &report) < last / 4);
    renderer_set_learned(fixture.renderer, learned);
    assert_non_null(renderer_get_learned(fixture.renderer, &print_again));
    assert_int_equal(print, print_again);
    double again = draw(&fixture, 13, &report);
    assert_true(again > 4 * first);
    free(learned);
    fixture_finish(&fixture);
}

/* No forecast has chosen what a request says by name. */
static void a_technique_that_was_asked_for_teaches_nothing(void **unused)
{
    (void)unused;
    struct fixture fixture;
    struct error err = {0};
    fixture_init(&fixture);
    const struct view view = {.width_px = 32,
                              .height_px = 24,
                              .camera = {.kind = VIEW_CAMERA_FIT},
                              .quality = {.samples = 1, .shadows = VIEW_SHADOWS_RAYTRACED}};
    for (int i = 0; i < 8; i++) {
        struct frame frame;
        assert_true(renderer_render(fixture.renderer, fixture.demo.key, &view, &frame, &err));
        frame_finish(&frame);
    }
    assert_int_equal(print_of(&fixture), 0);
    fixture_finish(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(expectations_follow_what_frames_take),
        cmocka_unit_test(what_was_learned_is_taken_along),
        cmocka_unit_test(a_technique_that_was_asked_for_teaches_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* `auto` learns from the frames that it chose for: what it expects of the next ones moves to what
 * they take, and pixels follow what is published alone. */
#include <math.h>
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
    struct auto_choice choice;
    const struct view chosen = rig_choose(fixture->renderer, fixture->demo.key, &view, &choice);
    if (!renderer_render(fixture->renderer, fixture->demo.key, &chosen, &frame, &err))
        fail_msg("%s", err.message);
    *report = frame.report;
    frame_finish(&frame);
    return report->chosen.expected_ms;
}

/* What rays are forecast to take for a camera that has moved so many steps. */
static double forecast(struct fixture *fixture, int step, bool is_moving)
{
    struct error err = {0};
    const struct view view = {
        .width_px = 64,
        .height_px = 48,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {1, 1.75 + 0.1 * step, 6.6},
                   .target = {-0.45, 2.95, -10},
                   .fov_y_deg = 52},
        .quality = {.samples = 1, .expects_reuse = true, .may_be_coarse = is_moving},
    };
    struct auto_choice choice;
    if (!renderer_choose(fixture->renderer, fixture->demo.key, &view, &choice, &err))
        fail_msg("%s", err.message);
    assert_true(choice.is_open);
    return choice.ms[SHADOWS_RAYTRACED];
}

/* Every eighth frame in motion is forecast, by fewer triangles; one at rest goes by its own
 * forecast, which is near. */
static void frames_in_motion_go_by_the_forecast_of_one(void **unused)
{
    (void)unused;
    struct fixture fixture;
    fixture_init(&fixture);
    double first = forecast(&fixture, 0, true);
    assert_true(first > 0);
    for (int step = 1; step < 8; step++)
        assert_true(forecast(&fixture, step, true) == first);
    double own = forecast(&fixture, 8, true);
    assert_true(own != first);
    double whole = forecast(&fixture, 8, false), still = forecast(&fixture, 3, false);
    assert_true(whole != own && fabs(whole / own - 1) < 0.2);
    assert_true(still != first && still != own && still != whole);
    assert_true(forecast(&fixture, 3, true) == own);
    fixture_finish(&fixture);
}

static void expectations_follow_what_frames_take(void **unused)
{
    (void)unused;
    struct fixture fixture;
    struct frame_report report;
    fixture_init(&fixture);
    assert_int_equal(print_of(&fixture), 0);
    double first = draw(&fixture, 0, &report); /* it may build */
    assert_int_equal(report.chosen.shadows, SHADOWS_RAYTRACED);
    draw(&fixture, 1, &report);
    assert_int_equal(print_of(&fixture), 0); /* two observations at most: nothing is published */
    double last = first;
    for (int step = 2; step < 14; step++)
        last = draw(&fixture, step, &report);
    assert_int_not_equal(print_of(&fixture), 0);
    assert_true(last > 8 * first);
    if (report.chosen.shadows == SHADOWS_RAYTRACED)
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
                              .quality = {.samples = 1, .shadows = SHADOWS_RAYTRACED}};
    for (int i = 0; i < 8; i++) {
        struct frame frame;
        assert_true(renderer_render(fixture.renderer, fixture.demo.key, &view, &frame, &err));
        frame_finish(&frame);
    }
    assert_int_equal(print_of(&fixture), 0);
    fixture_finish(&fixture);
}

/* ---- the runner-up ---- */

/* Maps that are known to be some faster than rays are said to be, about which nothing is known. */
static void teach_maps(struct fixture *fixture, const struct view *view)
{
    struct auto_choice choice;
    struct error err = {0};
    struct learning *learned = malloc(sizeof *learned);
    assert_non_null(learned);
    if (!renderer_choose(fixture->renderer, fixture->demo.key, view, &choice, &err))
        fail_msg("%s", err.message);
    const struct learning_case *frames = choice.frames;
    learning_init(learned);
    for (int i = 0; i < 12; i++)
        learning_teach(learned, &frames[SHADOWS_RASTER_DEFAULT],
                       learning_expect(learned, &frames[SHADOWS_RAYTRACED]).ms / 1.2);
    learning_show(learned, &frames[SHADOWS_RASTER_DEFAULT]);
    const struct auto_pick pick = auto_pick(frames, learned);
    assert_int_equal(pick.technique, SHADOWS_RASTER_DEFAULT);
    assert_true(pick.has_runner_up && pick.runner_up != SHADOWS_RASTER_DEFAULT);
    renderer_set_learned(fixture->renderer, learned);
    free(learned);
}

static const struct view still = {
    .width_px = 64,
    .height_px = 48,
    .camera = {.kind = VIEW_CAMERA_LOOK_AT,
               .eye = {1, 1.75, 6.6},
               .target = {-0.45, 2.95, -10},
               .fov_y_deg = 52},
    .quality = {.samples = 1, .shadow_resolution = 1024, .shadow_taps = 4, .expects_reuse = true},
};

/* Rays and maps of a small picture, shadows kept, are said to take about as long. */
static void fixture_init_idle(struct fixture *fixture)
{
    static const struct auto_settings measured = {.policy = AUTO_MEASURED,
                                                  .speed = {1, 1, 1, 1, 1}};
    fixture_init(fixture);
    renderer_set_auto(fixture->renderer, &measured);
    teach_maps(fixture, &still);
}

static struct image draw_still(struct fixture *fixture, enum shadow_technique shadows)
{
    struct view view = still;
    struct frame frame;
    struct error err = {0};
    struct auto_choice choice;
    view.quality.shadows = shadows;
    view = rig_choose(fixture->renderer, fixture->demo.key, &view, &choice);
    if (!renderer_render(fixture->renderer, fixture->demo.key, &view, &frame, &err))
        fail_msg("%s", err.message);
    struct image image = frame.outputs[VIEW_OUTPUT_COLOR];
    frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){.channels = 0};
    frame_finish(&frame);
    return image;
}

static void check_same(struct image *one, struct image *other)
{
    assert_int_equal(image_size_bytes(one), image_size_bytes(other));
    assert_memory_equal(one->pixels, other->pixels, image_size_bytes(one));
    image_finish(other);
}

/* Counts down to its end. */
static bool shall_stop(void *context)
{
    int *left = context;
    return *left >= 0 && (*left)-- == 0;
}

static enum runner_up_outcome time_it(struct fixture *fixture, int stop_at)
{
    return renderer_time_runner_up(
        fixture->renderer, fixture->demo.key, &still,
        &(struct runner_up_desc){.shall_stop = shall_stop, .context = &stop_at});
}

static void the_runner_up_is_timed_once_and_no_picture_changes(void **unused)
{
    (void)unused;
    struct fixture fixture;
    fixture_init_idle(&fixture);
    struct image deep = draw_still(&fixture, SHADOWS_DEEP);
    struct image rays = draw_still(&fixture, SHADOWS_RAYTRACED);
    assert_int_equal(time_it(&fixture, -1), RUNNER_UP_TIMED);
    struct image again = draw_still(&fixture, SHADOWS_DEEP);
    check_same(&deep, &again);
    again = draw_still(&fixture, SHADOWS_RAYTRACED);
    check_same(&rays, &again);
    for (int i = 0; i < 3; i++) /* the third, if it is worth it, and then none */
        (void)time_it(&fixture, -1);
    assert_int_equal(time_it(&fixture, -1), RUNNER_UP_NONE);
    image_finish(&deep);
    image_finish(&rays);
    fixture_finish(&fixture);
}

static void a_timing_ends_where_it_shall_and_leaves_nothing(void **unused)
{
    (void)unused;
    for (int stop_at = 0; stop_at < 3; stop_at++) {
        struct fixture fixture;
        fixture_init_idle(&fixture);
        struct image open = draw_still(&fixture, SHADOWS_AUTO);
        uint64_t print = print_of(&fixture);
        assert_int_equal(time_it(&fixture, stop_at), RUNNER_UP_STOPPED);
        assert_int_equal(print_of(&fixture), print);
        struct image again = draw_still(&fixture, SHADOWS_AUTO);
        check_same(&open, &again);
        image_finish(&open);
        fixture_finish(&fixture);
    }
}

static void nothing_is_timed_where_auto_measures_nothing(void **unused)
{
    (void)unused;
    static const enum auto_policy policies[] = {AUTO_RASTER, AUTO_RAYTRACED};
    for (int i = 0; i < 2; i++) {
        struct fixture fixture;
        fixture_init_idle(&fixture);
        renderer_set_auto(fixture.renderer, &(struct auto_settings){.policy = policies[i]});
        assert_int_equal(time_it(&fixture, -1), RUNNER_UP_NONE);
        fixture_finish(&fixture);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_in_motion_go_by_the_forecast_of_one),
        cmocka_unit_test(expectations_follow_what_frames_take),
        cmocka_unit_test(what_was_learned_is_taken_along),
        cmocka_unit_test(a_technique_that_was_asked_for_teaches_nothing),
        cmocka_unit_test(the_runner_up_is_timed_once_and_no_picture_changes),
        cmocka_unit_test(a_timing_ends_where_it_shall_and_leaves_nothing),
        cmocka_unit_test(nothing_is_timed_where_auto_measures_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

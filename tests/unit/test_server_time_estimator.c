/* SPDX-License-Identifier: MIT */
/* What a frame that was chosen for a time took counts for the next choice:
 * server/worker/time_estimator. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/base/processor.h"
#include "server/worker/time_estimator.h"

static const struct time_estimator_frame modelled = {
    .scene = "abc",
    .setting = {.shadows = SHADOWS_DEEP, .shadow_resolution = 512, .shadow_taps = 4, .samples = 4},
    .base_ms = 100,
};

static int create(void **state)
{
    struct error err = {0};
    *state = time_estimator_create(&err);
    return *state ? 0 : -1;
}

static int destroy(void **state)
{
    time_estimator_destroy(*state);
    return 0;
}

static struct time_estimator_frame with(struct time_estimator_frame frame,
                                        enum shadow_technique shadows)
{
    frame.setting.shadows = shadows;
    return frame;
}

/* What the programs of a scene that was never drawn are thought to cost. */
static double compile_ms(struct time_estimator *estimator)
{
    static int scenes;
    char scene[16];
    snprintf(scene, sizeof scene, "new %d", scenes++);
    struct time_estimator_frame frame = modelled;
    frame.scene = scene;
    double cold = time_estimator_expect(estimator, &frame);
    time_estimator_note_warm(estimator, scene);
    return cold - time_estimator_expect(estimator, &frame);
}

/* What so many bytes beyond those that are held are thought to cost. */
static double memory_ms(struct time_estimator *estimator, double held_bytes, double bytes)
{
    struct time_estimator_frame frame = modelled;
    double held = time_estimator_expect(estimator, &frame);
    frame.bytes = held_bytes + bytes;
    return time_estimator_expect(estimator, &frame) - held;
}

static void programs_that_do_not_stand_are_counted(void **state)
{
    struct time_estimator *estimator = *state;
    double first = time_estimator_expect(estimator, &modelled);
    assert_true(first > 100 + compile_ms(estimator));
    const struct time_estimator_frame rays = with(modelled, SHADOWS_RAYTRACED);
    assert_true(time_estimator_expect(estimator, &rays) < first - 900); /* it has none */
    time_estimator_note(estimator, &modelled, 3000, true);
    assert_true(compile_ms(estimator) > 1500); /* it took more than was thought */
    assert_true(time_estimator_expect(estimator, &modelled) < first - 900);
    struct time_estimator_frame other = modelled;
    other.setting.samples = 1;
    assert_true(time_estimator_expect(estimator, &other) > 400); /* other programs */
    other = modelled;
    other.scene = "another";
    assert_true(time_estimator_expect(estimator, &other) > 400);
    time_estimator_note_warm(estimator, "another");
    assert_true(time_estimator_expect(estimator, &other) < 300);
}

/* Compiling is learned within bounds: one frame at most doubles what it is thought to take. */
static void one_frame_does_not_turn_what_compiling_costs(void **state)
{
    struct time_estimator *estimator = *state;
    double before = compile_ms(estimator);
    time_estimator_note(estimator, &modelled, 1e9, true);
    assert_true(compile_ms(estimator) < 2.1 * before);
    for (int i = 0; i < 100; i++)
        time_estimator_note(estimator, &modelled, 1e9, true);
    assert_true(isfinite(compile_ms(estimator)));
    for (int i = 0; i < 100; i++)
        time_estimator_note(estimator, &modelled, 1e-9, true);
    assert_true(compile_ms(estimator) >= 1);
}

static void modelled_times_follow_what_frames_took(void **state)
{
    struct time_estimator *estimator = *state;
    for (int i = 0; i < 5; i++)
        time_estimator_note(estimator, &modelled, 300, false);
    double learned = time_estimator_expect(estimator, &modelled);
    assert_true(learned > 290 && learned < 400); /* a little above, to be kept */
    for (int i = 0; i < 8; i++)
        time_estimator_note(estimator, &modelled, 60, false);
    assert_true(time_estimator_expect(estimator, &modelled) < 90);
    struct time_estimator_frame warm = modelled;
    warm.is_warm = true;
    assert_true(time_estimator_expect(estimator, &warm) >
                time_estimator_expect(estimator, &modelled));
}

/* The less is known, the more careful. */
static void an_unknown_setting_is_promised_with_care(void **state)
{
    struct time_estimator *estimator = *state;
    const struct time_estimator_frame rays = with(modelled, SHADOWS_RAYTRACED);
    double unknown = time_estimator_expect(estimator, &rays);
    for (int i = 0; i < 6; i++)
        time_estimator_note(estimator, &rays, 100, false);
    assert_true(unknown > 130 && time_estimator_expect(estimator, &rays) < 120);
}

static void measured_times_grow_by_two_misses_alone(void **state)
{
    struct time_estimator *estimator = *state;
    struct time_estimator_frame measured = modelled;
    measured.is_measured = true;
    assert_true(time_estimator_expect(estimator, &measured) == 100);
    time_estimator_note(estimator, &measured, 20, false); /* the slowest run was measured */
    time_estimator_note(estimator, &measured, 20, false);
    assert_true(time_estimator_expect(estimator, &measured) == 100);
    measured.setting.shadow_taps = 9;
    time_estimator_note(estimator, &measured, 400, false);
    assert_true(time_estimator_expect(estimator, &measured) == 100);
    for (int i = 0; i < 4; i++)
        time_estimator_note(estimator, &measured, 400, false);
    assert_true(time_estimator_expect(estimator, &measured) > 300);
}

static void senseless_frames_teach_nothing(void **state)
{
    struct time_estimator *estimator = *state;
    struct time_estimator_frame frame = with(modelled, SHADOWS_RAYTRACED);
    double before = time_estimator_expect(estimator, &frame);
    const double senseless[] = {0, -1, NAN, INFINITY};
    for (int i = 0; i < 4; i++)
        time_estimator_note(estimator, &frame, senseless[i], false);
    frame.base_ms = 0;
    time_estimator_note(estimator, &frame, 7, false);
    assert_true(time_estimator_expect(estimator, &frame) == 0);
    frame.base_ms = 100;
    assert_true(time_estimator_expect(estimator, &frame) == before);
}

/* Memory that a frame is the first to have counts until one has had it. */
static void memory_to_be_made_is_counted_once(void **state)
{
    struct time_estimator *estimator = *state;
    struct time_estimator_frame large = modelled;
    for (int i = 0; i < 6; i++)
        time_estimator_note(estimator, &modelled, 100, false);
    double held = time_estimator_expect(estimator, &large);
    large.bytes = 400e6;
    double fresh = time_estimator_expect(estimator, &large);
    assert_true(fresh > held + 50);
    time_estimator_note(estimator, &large, 300, false);
    /* it took more than was thought */
    assert_true(memory_ms(estimator, 400e6, 400e6) > 150);
    assert_true(time_estimator_expect(estimator, &large) < 150); /* it is there */
    time_estimator_forget_memory(estimator);                     /* the worker rested */
    assert_true(time_estimator_expect(estimator, &large) > 230);
    for (int i = 0; i < 100; i++) {
        time_estimator_forget_memory(estimator);
        time_estimator_note(estimator, &large, i % 2 ? 1e9 : 1e-9, false);
        double ms = memory_ms(estimator, 400e6, 1e9);
        assert_true(ms >= 9.9 && ms <= 10001);
    }
}

/* The next start, of the same device. */
static void what_times_taught_outlives_the_server(void **state)
{
    struct time_estimator *estimator = *state, *next;
    struct error err = {0};
    char path[64];
    snprintf(path, sizeof path, "/tmp/vitrail-budgets-%d.json", (int)getpid());
    unlink(path);
    time_estimator_keep(estimator, path, "this");
    for (int i = 0; i < 40; i++)
        time_estimator_note(estimator, &modelled, 300, false);
    assert_int_equal(access(path, F_OK), 0); /* not at the end alone: it may be killed */
    time_estimator_note(estimator, &modelled, 290, false);
    double learned = time_estimator_expect(estimator, &modelled);
    time_estimator_destroy(estimator);
    *state = next = time_estimator_create(&err);
    assert_non_null(next);
    time_estimator_note(next,
                        &(struct time_estimator_frame){.scene = "abc", .setting = modelled.setting},
                        1, false); /* its programs stand */
    time_estimator_keep(next, path, "this");
    assert_true(time_estimator_expect(next, &modelled) == learned);
    struct time_estimator *other = time_estimator_create(&err);
    assert_non_null(other);
    time_estimator_keep(other, path, "another device");
    time_estimator_keep(other, path, "this"); /* the first call counts */
    assert_true(time_estimator_expect(other, &modelled) > 1000);
    time_estimator_destroy(other);
    unlink(path);
}

/* Two workers on devices of one kind. Times are learned to the bit; which programs stand and what
 * memory is there each knows of itself. */
static void frames_of_another_process_teach_as_own_ones(void **state)
{
    struct time_estimator *one = *state, *other;
    struct error err = {0};
    *state = other = time_estimator_create(&err);
    assert_non_null(other);
    const struct time_estimator_frame rays = with(modelled, SHADOWS_RAYTRACED);
    struct time_estimator_frame large = modelled;
    large.bytes = 400e6;
    assert_null(time_estimator_take_lessons(one));
    for (int i = 0; i < 6; i++)
        time_estimator_note(one, &rays, 300, false);
    time_estimator_note(one, &modelled, 5000, true);
    time_estimator_note(one, &modelled, 130, false);
    time_estimator_note(one, &large, 300, false);
    json_t *lessons = time_estimator_take_lessons(one);
    assert_int_equal(json_array_size(lessons), 9);
    assert_null(time_estimator_take_lessons(one)); /* each once */
    time_estimator_learn(other, NULL);
    time_estimator_learn(other, lessons);
    assert_null(time_estimator_take_lessons(other)); /* they are not its own */
    json_decref(lessons);
    assert_true(time_estimator_expect(other, &rays) == time_estimator_expect(one, &rays));
    assert_true(compile_ms(other) == compile_ms(one) && compile_ms(one) > 2500);
    assert_true(time_estimator_expect(other, &modelled) >
                time_estimator_expect(one, &modelled) + 2500);
    time_estimator_note_warm(other, modelled.scene);
    assert_true(time_estimator_expect(other, &modelled) == time_estimator_expect(one, &modelled));
    assert_true(time_estimator_expect(other, &large) > time_estimator_expect(one, &large) + 100);
    time_estimator_destroy(one);
}

static void lessons_that_nobody_takes_are_the_last_ones(void **state)
{
    struct time_estimator *estimator = *state;
    for (int i = 1; i <= 40; i++)
        time_estimator_note(estimator, &modelled, i, false);
    json_t *lessons = time_estimator_take_lessons(estimator);
    assert_int_equal(json_array_size(lessons), 16);
    for (size_t i = 0; i < 16; i++)
        assert_true(json_number_value(json_object_get(json_array_get(lessons, i), "ms")) ==
                    25. + (double)i);
    json_decref(lessons);
}

static void a_machine_is_never_quicker_than_alone(void **state)
{
    (void)state;
    double crowding = processor_crowding();
    assert_true(crowding >= 1 && crowding <= 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(programs_that_do_not_stand_are_counted, create, destroy),
        cmocka_unit_test_setup_teardown(one_frame_does_not_turn_what_compiling_costs, create,
                                        destroy),
        cmocka_unit_test_setup_teardown(modelled_times_follow_what_frames_took, create, destroy),
        cmocka_unit_test_setup_teardown(an_unknown_setting_is_promised_with_care, create, destroy),
        cmocka_unit_test_setup_teardown(measured_times_grow_by_two_misses_alone, create, destroy),
        cmocka_unit_test_setup_teardown(senseless_frames_teach_nothing, create, destroy),
        cmocka_unit_test_setup_teardown(memory_to_be_made_is_counted_once, create, destroy),
        cmocka_unit_test_setup_teardown(what_times_taught_outlives_the_server, create, destroy),
        cmocka_unit_test_setup_teardown(frames_of_another_process_teach_as_own_ones, create,
                                        destroy),
        cmocka_unit_test_setup_teardown(lessons_that_nobody_takes_are_the_last_ones, create,
                                        destroy),
        cmocka_unit_test(a_machine_is_never_quicker_than_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

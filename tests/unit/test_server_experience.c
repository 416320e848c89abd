/* SPDX-License-Identifier: MIT */
/* What a frame that was chosen for a time took counts for the next choice:
 * server/worker/experience. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/base/processor.h"
#include "server/worker/experience.h"

static const struct experience_frame modelled = {
    .scene = "abc",
    .setting = {.shadows = SHADOWS_DEEP, .shadow_resolution = 512, .shadow_taps = 4, .samples = 4},
    .base_ms = 100,
};

static int create(void **state)
{
    struct error err = {0};
    *state = experience_create(&err);
    return *state ? 0 : -1;
}

static int destroy(void **state)
{
    experience_destroy(*state);
    return 0;
}

static struct experience_frame with(struct experience_frame frame, enum shadow_technique shadows)
{
    frame.setting.shadows = shadows;
    return frame;
}

static void programs_that_do_not_stand_are_counted(void **state)
{
    struct experience *experience = *state;
    double first = experience_expect(experience, &modelled);
    assert_true(first > 100 + experience_compile_ms(experience));
    const struct experience_frame rays = with(modelled, SHADOWS_RAYTRACED);
    assert_true(experience_expect(experience, &rays) < first - 900); /* it has none */
    experience_note(experience, &modelled, 3000, true);
    assert_true(experience_compile_ms(experience) > 1500); /* it took more than was thought */
    assert_true(experience_expect(experience, &modelled) < first - 900);
    struct experience_frame other = modelled;
    other.setting.samples = 1;
    assert_true(experience_expect(experience, &other) > 400); /* other programs */
    other = modelled;
    other.scene = "another";
    assert_true(experience_expect(experience, &other) > 400);
    experience_note_warm(experience, "another");
    assert_true(experience_expect(experience, &other) < 300);
    experience_forget_programs(experience); /* a new worker */
    assert_true(experience_expect(experience, &modelled) > 400);
}

/* Compiling is learned within bounds: one frame at most doubles what it is thought to take. */
static void one_frame_does_not_turn_what_compiling_costs(void **state)
{
    struct experience *experience = *state;
    double before = experience_compile_ms(experience);
    experience_note(experience, &modelled, 1e9, true);
    assert_true(experience_compile_ms(experience) < 2.1 * before);
    for (int i = 0; i < 100; i++)
        experience_note(experience, &modelled, 1e9, true);
    assert_true(isfinite(experience_compile_ms(experience)));
    for (int i = 0; i < 100; i++)
        experience_note(experience, &modelled, 1e-9, true);
    assert_true(experience_compile_ms(experience) >= 1);
}

static void modelled_times_follow_what_frames_took(void **state)
{
    struct experience *experience = *state;
    for (int i = 0; i < 5; i++)
        experience_note(experience, &modelled, 300, false);
    double learned = experience_expect(experience, &modelled);
    assert_true(learned > 290 && learned < 400); /* a little above, to be kept */
    for (int i = 0; i < 8; i++)
        experience_note(experience, &modelled, 60, false);
    assert_true(experience_expect(experience, &modelled) < 90);
    struct experience_frame warm = modelled;
    warm.is_warm = true;
    assert_true(experience_expect(experience, &warm) > experience_expect(experience, &modelled));
}

/* The less is known, the more careful. */
static void an_unknown_setting_is_promised_with_care(void **state)
{
    struct experience *experience = *state;
    const struct experience_frame rays = with(modelled, SHADOWS_RAYTRACED);
    double unknown = experience_expect(experience, &rays);
    for (int i = 0; i < 6; i++)
        experience_note(experience, &rays, 100, false);
    assert_true(unknown > 130 && experience_expect(experience, &rays) < 120);
}

static void measured_times_grow_by_two_misses_alone(void **state)
{
    struct experience *experience = *state;
    struct experience_frame measured = modelled;
    measured.is_measured = true;
    assert_true(experience_expect(experience, &measured) == 100);
    experience_note(experience, &measured, 20, false); /* the slowest run was measured */
    experience_note(experience, &measured, 20, false);
    assert_true(experience_expect(experience, &measured) == 100);
    measured.setting.shadow_taps = 9;
    experience_note(experience, &measured, 400, false);
    assert_true(experience_expect(experience, &measured) == 100);
    for (int i = 0; i < 4; i++)
        experience_note(experience, &measured, 400, false);
    assert_true(experience_expect(experience, &measured) > 300);
}

static void senseless_frames_teach_nothing(void **state)
{
    struct experience *experience = *state;
    struct experience_frame frame = with(modelled, SHADOWS_RAYTRACED);
    double before = experience_expect(experience, &frame);
    const double senseless[] = {0, -1, NAN, INFINITY};
    for (int i = 0; i < 4; i++)
        experience_note(experience, &frame, senseless[i], false);
    frame.base_ms = 0;
    experience_note(experience, &frame, 7, false);
    assert_true(experience_expect(experience, &frame) == 0);
    frame.base_ms = 100;
    assert_true(experience_expect(experience, &frame) == before);
}

/* Memory that a frame is the first to have counts until one has had it. */
static void memory_to_be_made_is_counted_once(void **state)
{
    struct experience *experience = *state;
    struct experience_frame large = modelled;
    for (int i = 0; i < 6; i++)
        experience_note(experience, &modelled, 100, false);
    double held = experience_expect(experience, &large);
    large.bytes = 400e6;
    double fresh = experience_expect(experience, &large);
    assert_true(fabs(fresh - held - experience_memory_ms(experience, 400e6)) < 1e-6);
    assert_true(fresh > held + 50);
    experience_note(experience, &large, 300, false);
    assert_true(experience_memory_ms(experience, 400e6) > 150); /* it took more than was thought */
    assert_true(experience_expect(experience, &large) < 150);   /* it is there */
    experience_forget_memory(experience);                       /* the worker rested */
    assert_true(experience_expect(experience, &large) > 230);
    for (int i = 0; i < 100; i++) {
        experience_forget_memory(experience);
        experience_note(experience, &large, i % 2 ? 1e9 : 1e-9, false);
        double ms = experience_memory_ms(experience, 1e9);
        assert_true(ms >= 9.9 && ms <= 10001);
    }
}

/* The next start, of the same device. */
static void what_times_taught_outlives_the_server(void **state)
{
    struct experience *experience = *state, *next;
    struct error err = {0};
    char path[64];
    snprintf(path, sizeof path, "/tmp/vitrail-budgets-%d.json", (int)getpid());
    unlink(path);
    experience_keep(experience, path, "this");
    for (int i = 0; i < 40; i++)
        experience_note(experience, &modelled, 300, false);
    assert_int_equal(access(path, F_OK), 0); /* not at the end alone: it may be killed */
    experience_note(experience, &modelled, 290, false);
    double learned = experience_expect(experience, &modelled);
    experience_destroy(experience);
    *state = next = experience_create(&err);
    assert_non_null(next);
    experience_note(next, &(struct experience_frame){.scene = "abc", .setting = modelled.setting},
                    1, false); /* its programs stand */
    experience_keep(next, path, "this");
    assert_true(experience_expect(next, &modelled) == learned);
    struct experience *other = experience_create(&err);
    assert_non_null(other);
    experience_keep(other, path, "another device");
    experience_keep(other, path, "this"); /* the first call counts */
    assert_true(experience_expect(other, &modelled) > 1000);
    experience_destroy(other);
    unlink(path);
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
        cmocka_unit_test(a_machine_is_never_quicker_than_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

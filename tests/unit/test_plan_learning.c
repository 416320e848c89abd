/* SPDX-License-Identifier: MIT */
/* Forecasts that learn: the filter by itself, and the rule of `auto` over recorded times. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/auto_replay.h"

static struct learning_case make_frame(enum shadow_technique technique, uint64_t view)
{
    return (struct learning_case){.terms = {[FORECAST_TERM_FRAME] = 1,
                                            [FORECAST_TERM_PIXELS] = 20,
                                            [FORECAST_TERM_LIGHTS] = 30,
                                            [FORECAST_TERM_WALKS] = 49},
                                  .technique = technique,
                                  .view = view};
}

static struct learning *fresh(void)
{
    struct learning *learning = malloc(sizeof *learning);
    assert_non_null(learning);
    learning_init(learning);
    return learning;
}

static double expect_ms(const struct learning *learning, const struct learning_case *frame)
{
    return learning_expect(learning, frame).ms;
}

static void teach(struct learning *learning, const struct learning_case *frame, double ms,
                  int times)
{
    for (int i = 0; i < times; i++) {
        learning_teach(learning, frame, ms);
        assert_true(learning_is_sound(learning));
    }
}

static void nothing_learned_is_the_sum(void **unused)
{
    (void)unused;
    struct learning *learning = fresh();
    const struct learning_case frame = make_frame(SHADOWS_RASTER_DEFAULT, 6);
    struct learning_answer answer = learning_expect(learning, &frame);
    assert_true(fabs(answer.ms - 100) < 1e-9 && answer.observations == 0 && answer.doubt > 0.2);
    assert_true(learning_is_sound(learning));
    const struct learning_case empty = {.technique = SHADOWS_RAYTRACED};
    assert_true(expect_ms(learning, &empty) == 0);
    free(learning);
}

/* Three frames are enough for whatever they take, one is not. */
static void three_observations_turn_an_expectation_and_one_does_not(void **unused)
{
    (void)unused;
    const double taken[] = {25, 50, 200, 400};
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++) {
        struct learning *learning = fresh();
        const struct learning_case frame = make_frame(SHADOWS_RASTER_DEFAULT, 6);
        teach(learning, &frame, taken[i], 1);
        double once = expect_ms(learning, &frame);
        assert_true(once < 125.5 && once > 40);
        teach(learning, &frame, taken[i], 3);
        assert_true(fabs(log(expect_ms(learning, &frame) / taken[i])) < log(1.1));
        free(learning);
    }
}

static void an_outlier_of_ten_is_all_but_passed_over(void **unused)
{
    (void)unused;
    struct learning *learning = fresh();
    const struct learning_case frame = make_frame(SHADOWS_RASTER_DEFAULT, 6);
    teach(learning, &frame, 100, 4);
    teach(learning, &frame, 1000, 1);
    assert_true(expect_ms(learning, &frame) < 126);
    teach(learning, &frame, 100, 2);
    assert_true(fabs(expect_ms(learning, &frame) - 100) < 12);
    free(learning);
}

/* What one view and technique taught is of use to others, and only in part. */
static void a_slower_machine_is_slower_for_all(void **unused)
{
    (void)unused;
    struct learning *learning = fresh();
    const struct learning_case taught = make_frame(SHADOWS_RASTER_DEFAULT, 6);
    const struct learning_case other_view = make_frame(SHADOWS_RASTER_DEFAULT, 8);
    const struct learning_case other_technique = make_frame(SHADOWS_RAYTRACED_SHADOWS, 8);
    teach(learning, &taught, 200, 6);
    assert_true(expect_ms(learning, &other_view) > 160 && expect_ms(learning, &other_view) < 220);
    assert_true(expect_ms(learning, &other_technique) > 120);
    assert_true(expect_ms(learning, &other_technique) < expect_ms(learning, &other_view));
    assert_true(learning_expect(learning, &other_view).doubt <
                learning_expect(learning, &other_technique).doubt);
    free(learning);
}

/* A term that is wrong is found by frames that have more or less of it. */
static void terms_are_told_apart(void **unused)
{
    (void)unused;
    struct learning *learning = fresh();
    struct learning_case frame = make_frame(SHADOWS_RASTER_DEFAULT, 0);
    for (int i = 0; i < 60; i++) {
        double walks = 10 + 60 * (i % 5);
        frame.terms[FORECAST_TERM_WALKS] = walks;
        learning_teach(learning, &frame, 51 + 3 * walks); /* three times what is told */
    }
    frame.terms[FORECAST_TERM_WALKS] = 10;
    assert_true(fabs(log(expect_ms(learning, &frame) / 81)) < log(1.15));
    frame.terms[FORECAST_TERM_WALKS] = 250;
    assert_true(fabs(log(expect_ms(learning, &frame) / 801)) < log(1.15));
    assert_true(learning->factor[FORECAST_TERM_WALKS] > 0.7);
    free(learning);
}

/* ---- what a view was last drawn by ---- */

enum {
    FIRST = SHADOWS_RASTER_DEFAULT,
    SECOND = SHADOWS_RAYTRACED,
    THIRD = SHADOWS_RAYTRACED_SHADOWS
};

/* Three techniques of a view, of which the first two took so long, and the first drew it last. */
static struct auto_pick pick_beside(double first_ms, double second_ms, double third_told)
{
    struct learning *learning = fresh();
    struct learning_case frames[SHADOWS_COUNT];
    for (int i = 0; i < SHADOWS_COUNT; i++)
        frames[i] = (struct learning_case){.technique = (enum shadow_technique)i,
                                           .terms = {[FORECAST_TERM_FRAME] = 1e6},
                                           .view = 6};
    struct learning_case *first = &frames[FIRST], *second = &frames[SECOND];
    struct learning_case *third = &frames[THIRD];
    first->terms[FORECAST_TERM_FRAME] = second->terms[FORECAST_TERM_FRAME] = 0;
    third->terms[FORECAST_TERM_FRAME] = 0;
    first->terms[FORECAST_TERM_PIXELS] = second->terms[FORECAST_TERM_RAYS] = 100;
    teach(learning, first, first_ms, 6);
    if (second_ms > 0)
        teach(learning, second, second_ms, 6);
    learning_show(learning, first);
    third->terms[FORECAST_TERM_POINTS] = 1;
    third->terms[FORECAST_TERM_POINTS] = third_told / expect_ms(learning, third);
    if (!(second_ms > 0))
        second->terms[FORECAST_TERM_RAYS] = 1e4;
    const struct auto_pick pick = auto_pick(frames, learning);
    free(learning);
    return pick;
}

static void the_technique_of_the_last_picture_stays_until_another_gains(void **unused)
{
    (void)unused;
    assert_int_equal(pick_beside(100, 97, 400).technique, FIRST);
    assert_int_equal(pick_beside(100, 90, 400).technique, SECOND);
    assert_int_equal(pick_beside(100, 0, 85).technique, FIRST); /* it is only forecast */
    assert_int_equal(pick_beside(100, 0, 60).technique, THIRD);
    assert_int_equal(pick_beside(100, 90, 60).technique, THIRD);
}

static void a_technique_that_may_gain_is_worth_timing(void **unused)
{
    (void)unused;
    const struct auto_pick pick = pick_beside(100, 97, 110);
    assert_true(pick.has_runner_up && (int)pick.runner_up == THIRD && (int)pick.technique == FIRST);
    assert_false(pick_beside(100, 97, 250).has_runner_up); /* not to take so long */
    assert_false(pick_beside(100, 0, 1e5).has_runner_up);
}

static void one_technique_is_the_last(void **unused)
{
    (void)unused;
    struct learning *learning = fresh();
    const struct learning_case maps = make_frame(SHADOWS_RASTER_DEFAULT, 6);
    const struct learning_case rays = make_frame(SHADOWS_RAYTRACED, 6);
    const struct learning_case other = make_frame(SHADOWS_RASTER_DEFAULT, 8);
    learning_show(learning, &maps); /* of which nothing is known */
    assert_false(learning_expect(learning, &maps).is_shown);
    teach(learning, &maps, 100, 1);
    teach(learning, &rays, 100, 1);
    teach(learning, &other, 100, 1);
    learning_show(learning, &maps);
    learning_show(learning, &other);
    learning_show(learning, &rays);
    assert_false(learning_expect(learning, &maps).is_shown);
    assert_true(learning_expect(learning, &rays).is_shown);
    assert_true(learning_expect(learning, &other).is_shown);
    assert_true(learning_is_sound(learning));
    free(learning);
}

static void senseless_times_teach_nothing(void **unused)
{
    (void)unused;
    struct learning *learning = fresh(), *before = fresh();
    struct learning_case frame = make_frame(SHADOWS_RASTER_DEFAULT, 6);
    const double senseless[] = {0, -1, NAN, INFINITY};
    for (size_t i = 0; i < 4; i++)
        learning_teach(learning, &frame, senseless[i]);
    frame.terms[FORECAST_TERM_WALKS] = NAN;
    learning_teach(learning, &frame, 10);
    frame.terms[FORECAST_TERM_WALKS] = INFINITY;
    learning_teach(learning, &frame, 10);
    assert_memory_equal(learning->factor, before->factor, sizeof before->factor);
    assert_int_equal(learning->clock, 0);
    free(learning);
    free(before);
}

static void what_teaching_cannot_have_made_is_not_sound(void **unused)
{
    (void)unused;
    struct learning *good = fresh(), *bad = fresh();
    const struct learning_case frame = make_frame(SHADOWS_RASTER_DEFAULT, 6);
    teach(good, &frame, 150, 5);
    *bad = *good;
    bad->factor[3] = NAN;
    assert_false(learning_is_sound(bad));
    *bad = *good;
    bad->factor[3] = 50;
    assert_false(learning_is_sound(bad));
    *bad = *good;
    bad->doubt[2][2] = -1;
    assert_false(learning_is_sound(bad));
    *bad = *good;
    bad->doubt[2][3] = bad->doubt[3][2] = 10;
    assert_false(learning_is_sound(bad));
    *bad = *good;
    bad->run[1].count = 1000;
    assert_false(learning_is_sound(bad));
    *bad = *good;
    bad->views[9].off = 1e9;
    assert_false(learning_is_sound(bad));
    *bad = *good;
    bad->views[9].clock = bad->clock + 1;
    assert_false(learning_is_sound(bad));
    *bad = *good;
    bad->views[0].is_shown = 2;
    assert_false(learning_is_sound(bad));
    free(good);
    free(bad);
}

/* Thousands of views and random times, and every number stays within its bounds. */
static void observations_of_any_kind_leave_it_sound(void **unused)
{
    (void)unused;
    struct learning *learning = fresh();
    uint64_t state = 12345;
    for (int i = 0; i < 3000; i++) {
        struct learning_case frame = {.view = 0};
        for (int k = 0; k < FORECAST_TERM_COUNT; k++) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            frame.terms[k] = state >> 60 ? 0 : ldexp(1, (int)(state >> 33 & 31) - 12);
        }
        frame.terms[state >> 40 & 7] += 1;
        frame.technique = state >> 50 & 1 ? SHADOWS_RAYTRACED : SHADOWS_RASTER_DEFAULT;
        frame.view = state >> 20 & 1023;
        learning_teach(learning, &frame, ldexp(1, (int)(state >> 12 & 31) - 10));
    }
    assert_true(learning_is_sound(learning));
    assert_int_equal(learning->clock, 3000);
    free(learning);
}

/* ---- auto ---- */

static const char *const recorded[] = {
    VITRAIL_SOURCE_DIR "/tests/data/auto_timings.json", /* one core */
    VITRAIL_SOURCE_DIR "/tests/data/auto_timings_two_cores.json",
};
enum { RECORDED = sizeof recorded / sizeof *recorded };

static void read_recorded(struct replay *replay, const char *path)
{
    struct error err = {0};
    json_t *json = json_load_file(path, 0, NULL);
    assert_non_null(json);
    if (!replay_from_json(replay, json, &err))
        fail_msg("%s", err.message);
    json_decref(json);
    assert_true(replay->count >= 40);
}

struct shares {
    double first, later, worst, worst_later, told;
};

static struct shares run_one(const char *path, const struct replay_trouble *trouble)
{
    static struct replay replay;
    struct shares shares = {0};
    read_recorded(&replay, path);
    for (int i = 0; i < replay.count; i++) {
        struct learning *learned = fresh();
        struct replay_result result = replay_run(&replay, &replay.cases[i], learned, trouble);
        assert_true(learning_is_sound(learned));
        free(learned);
        if (result.first > 1.25 || result.later > 1.1)
            print_message("%s: first %.2f, later %.2f\n", replay.cases[i].name, result.first,
                          result.later);
        shares.first += (result.first <= 1.25) / (double)replay.count;
        shares.later += (result.later <= 1.1) / (double)replay.count;
        shares.told += (result.later_off <= 1.25) / (double)replay.count;
        shares.worst = fmax(shares.worst, result.first);
        shares.worst_later = fmax(shares.worst_later, result.later);
    }
    print_message("first %.3f, worst %.2f; later %.3f, worst %.2f; told within 1.25 %.3f\n",
                  shares.first, shares.worst, shares.later, shares.worst_later, shares.told);
    return shares;
}

/* The worst of all recordings. */
static struct shares run_all(const struct replay_trouble *trouble)
{
    struct shares all = run_one(recorded[0], trouble);
    for (int i = 1; i < RECORDED; i++) {
        const struct shares shares = run_one(recorded[i], trouble);
        all.first = fmin(all.first, shares.first);
        all.later = fmin(all.later, shares.later);
        all.told = fmin(all.told, shares.told);
        all.worst = fmax(all.worst, shares.worst);
        all.worst_later = fmax(all.worst_later, shares.worst_later);
    }
    return all;
}

static void auto_keeps_its_bars_on_recorded_times(void **unused)
{
    (void)unused;
    const struct shares shares = run_all(NULL);
    assert_true(shares.first >= 0.9 && shares.worst <= 2);
    assert_true(shares.later >= 0.95 && shares.told >= 0.95);
}

static void an_outlier_does_not_turn_auto(void **unused)
{
    (void)unused;
    for (int at = 1; at <= REPLAY_LATER; at++)
        assert_true(run_all(&(struct replay_trouble){.outlier_at = at}).later >= 0.95);
}

static void a_machine_half_as_fast_does_not_turn_auto(void **unused)
{
    (void)unused;
    const struct shares shares = run_all(&(struct replay_trouble){.slower = 2});
    assert_true(shares.later >= 0.95 && shares.told >= 0.95);
}

/* One learner over all views in turn, as a server has it: what one scene teaches may cost another a
 * first choice, but not the bar. The shares of all recordings together. */
static void observations_of_other_scenes_do_no_harm(void **unused)
{
    (void)unused;
    static struct replay replay;
    double first = 0, later = 0;
    for (int k = 0; k < RECORDED; k++) {
        struct learning *learned = fresh();
        read_recorded(&replay, recorded[k]);
        for (int i = 0; i < replay.count; i++) {
            struct replay_result result = replay_run(&replay, &replay.cases[i], learned, NULL);
            first += (result.first <= 1.25) / (double)replay.count / RECORDED;
            later += (result.later <= 1.1) / (double)replay.count / RECORDED;
        }
        free(learned);
    }
    print_message("one learner: first %.3f, later %.3f\n", first, later);
    assert_true(first >= 0.9 && later >= 0.95);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_learned_is_the_sum),
        cmocka_unit_test(three_observations_turn_an_expectation_and_one_does_not),
        cmocka_unit_test(an_outlier_of_ten_is_all_but_passed_over),
        cmocka_unit_test(a_slower_machine_is_slower_for_all),
        cmocka_unit_test(terms_are_told_apart),
        cmocka_unit_test(the_technique_of_the_last_picture_stays_until_another_gains),
        cmocka_unit_test(a_technique_that_may_gain_is_worth_timing),
        cmocka_unit_test(one_technique_is_the_last),
        cmocka_unit_test(senseless_times_teach_nothing),
        cmocka_unit_test(what_teaching_cannot_have_made_is_not_sound),
        cmocka_unit_test(observations_of_any_kind_leave_it_sound),
        cmocka_unit_test(auto_keeps_its_bars_on_recorded_times),
        cmocka_unit_test(an_outlier_does_not_turn_auto),
        cmocka_unit_test(a_machine_half_as_fast_does_not_turn_auto),
        cmocka_unit_test(observations_of_other_scenes_do_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* The scale of moving frames: it holds the budget, and stands still where costs only waver. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/views/live_scale.h"

static const double BUDGET_MS = 50;

/* Frames of a scene that takes so long at full scale, every tenth of them longer by a factor. */
static double run(struct live_scale *costs, double scale, double whole_ms, int frames,
                  double hiccup, int *changes)
{
    for (int i = 1; i <= frames; i++) {
        double cost_ms = (5 + whole_ms * scale * scale) * (i % 10 == 5 ? hiccup : 1);
        double next = live_scale_next(costs, scale, cost_ms, BUDGET_MS, 0.1);
        *changes += next != scale;
        scale = next;
    }
    return scale;
}

static void a_scale_holds_the_budget_and_stands_still(void **unused)
{
    (void)unused;
    for (double whole_ms = 10; whole_ms < 3000; whole_ms *= 1.3) {
        struct live_scale costs = {.count = 0};
        int before = 0, after = 0;
        double scale = run(&costs, 0.5, whole_ms, 12, 1, &before);
        assert_true(5 + whole_ms * scale * scale <= BUDGET_MS);
        assert_true(run(&costs, scale, whole_ms, 40, 1, &after) == scale);
        assert_int_equal(after, 0);
    }
}

static void one_frame_that_was_delayed_a_little_changes_nothing(void **unused)
{
    (void)unused;
    struct live_scale costs = {.count = 0};
    int before = 0, slow = 0, quick = 0;
    double scale = run(&costs, 0.5, 250, 12, 1, &before);
    assert_true(scale == 0.375);
    assert_true(run(&costs, scale, 250, 40, 1.8, &slow) == scale);
    assert_true(run(&costs, scale, 250, 40, 0.1, &quick) == scale);
    assert_int_equal(slow + quick, 0);
}

/* It may be the first of many, so that the next one is smaller; where it was the only one, the
 * scale is back after two more. */
static void one_frame_far_over_the_budget_changes_one_or_two(void **unused)
{
    (void)unused;
    struct live_scale costs = {.count = 0};
    int changes = 0;
    const double scale = run(&costs, 0.5, 210, 12, 1, &changes); /* 34.5 ms: room to come back */
    assert_true(scale == 0.375);
    double next = live_scale_next(&costs, scale, 2 * BUDGET_MS, BUDGET_MS, 0.1);
    assert_true(next < scale);
    for (int i = 0; i < 3; i++)
        next = live_scale_next(&costs, next, 5 + 210 * next * next, BUDGET_MS, 0.1);
    assert_true(next == scale);
}

/* By pixels alone, seen from 0.375, 0.5 would take 45 ms, too near the budget to be tried: it takes
 * 37.5. Three frames of each of two scales tell. */
static void what_does_not_grow_with_the_picture_is_learned(void **unused)
{
    (void)unused;
    struct live_scale costs = {.count = 0};
    const double fixed_ms = 10, whole_ms = 110;
    double scale = 0.25;
    int held = 0;
    for (int i = 0; i < 60; i++) {
        double cost_ms = fixed_ms + whole_ms * scale * scale;
        assert_true(cost_ms <= BUDGET_MS);
        double next = live_scale_next(&costs, scale, cost_ms, BUDGET_MS, 0.1);
        scale = i < 2 ? scale : next;
        held += scale == 0.5;
    }
    assert_true(held > 50);
    assert_true(fabs(costs.fixed_ms - fixed_ms) <= 2);
}

/* The camera turns to what costs three times as much just when the scale changes, which looks like
 * a large fixed part. */
static void a_false_fixed_part_does_not_break_the_budget(void **unused)
{
    (void)unused;
    for (double whole_ms = 150; whole_ms < 1500; whole_ms *= 1.1) {
        struct live_scale costs = {.count = 0};
        double scale = 0.5, costlier = 1;
        int over = 0;
        for (int i = 0; i < 100; i++) {
            double cost_ms = costlier * (2 + whole_ms * scale * scale);
            double next = live_scale_next(&costs, scale, cost_ms, BUDGET_MS, 0.1);
            over += i > 3 && cost_ms > BUDGET_MS;
            if (next != scale && i >= LIVE_SCALE_COSTS)
                costlier = 3;
            scale = next;
        }
        assert_true(over <= 6);
    }
}

/* Within a frame down, and within eight up. */
static void what_has_become_slower_or_quicker_is_followed(void **unused)
{
    (void)unused;
    struct live_scale costs = {.count = 0};
    int changes = 0;
    double scale = run(&costs, 0.5, 250, 12, 1, &changes);
    scale = run(&costs, scale, 1500, 1, 1, &changes);
    assert_true(5 + 1500 * scale * scale <= BUDGET_MS);
    scale = run(&costs, scale, 20, 8, 1, &changes);
    assert_true(scale == 1);
}

static void a_least_scale_is_kept(void **unused)
{
    (void)unused;
    struct live_scale costs = {.count = 0};
    assert_true(live_scale_next(&costs, 0.5, 1e6, BUDGET_MS, 0.3) == 0.3);
    costs = (struct live_scale){.count = 0};
    assert_true(live_scale_next(&costs, 0.5, 1e6, BUDGET_MS, 0.1) == 0.1);
    costs = (struct live_scale){.count = 0};
    assert_true(live_scale_next(&costs, 0.5, 0, BUDGET_MS, 0.1) == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_scale_holds_the_budget_and_stands_still),
        cmocka_unit_test(one_frame_that_was_delayed_a_little_changes_nothing),
        cmocka_unit_test(one_frame_far_over_the_budget_changes_one_or_two),
        cmocka_unit_test(what_does_not_grow_with_the_picture_is_learned),
        cmocka_unit_test(a_false_fixed_part_does_not_break_the_budget),
        cmocka_unit_test(what_has_become_slower_or_quicker_is_followed),
        cmocka_unit_test(a_least_scale_is_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

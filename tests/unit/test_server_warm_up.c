/* SPDX-License-Identifier: MIT */
/* Scenes that wait to be warmed up: which goes when there are too many, what is left of one that
 * gave way or was drawn, and what is counted. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/front/warm_up.h"

static struct render_task *task(char scene, bool is_at_start)
{
    struct render_task *made = render_task_create();
    snprintf(made->scene, sizeof made->scene, "%c", scene);
    made->question = json_pack("{s:s,s:b}", "warm_up", "all", "at_start", is_at_start);
    return made;
}

static const char *asked(const struct render_task *task)
{
    return json_string_value(json_object_get(task->question, "warm_up"));
}

/* Takes all; they are the scenes of these letters. */
static void check_order(struct warm_ups *warm_ups, const char *expected)
{
    for (; *expected; expected++) {
        struct render_task *first = warm_ups_take(warm_ups);
        assert_non_null(first);
        assert_int_equal(*expected, first->scene[0]);
        render_task_destroy(first);
    }
    assert_null(warm_ups_take(warm_ups));
}

static void too_many_lose_the_least_wanted(void **state)
{
    (void)state;
    struct warm_ups warm_ups = {0};
    for (const char *scene = "abcde"; *scene; scene++)
        warm_ups_add(&warm_ups, task(*scene, false));
    assert_int_equal(1, warm_ups.dropped);
    check_order(&warm_ups, "bcde");                   /* of those that were posted the oldest */
    for (const char *scene = "abcd"; *scene; scene++) /* the last used first */
        warm_ups_add(&warm_ups, task(*scene, true));
    warm_ups_add(&warm_ups, task('e', false));
    warm_ups_add(&warm_ups, task('f', false));
    check_order(&warm_ups, "abef");
    for (const char *scene = "abcd"; *scene; scene++)
        warm_ups_add(&warm_ups, task(*scene, *scene == 'a'));
    warm_ups_note_drawn(&warm_ups, "c");
    warm_ups_add(&warm_ups, task('e', false));
    check_order(&warm_ups, "abde"); /* what is drawn has most of it */
    assert_int_equal(4, warm_ups.dropped);
}

static void a_scene_waits_once_until_it_is_gone(void **state)
{
    (void)state;
    struct warm_ups warm_ups = {0};
    for (const char *scene = "abab"; *scene; scene++)
        warm_ups_add(&warm_ups, task(*scene, false));
    assert_int_equal(2, warm_ups.count);
    warm_ups_drop(&warm_ups, "a");
    assert_int_equal(0, warm_ups.dropped); /* nobody wants it */
    check_order(&warm_ups, "b");
}

static void a_scene_that_was_drawn_has_its_structures_left(void **state)
{
    (void)state;
    struct warm_ups warm_ups = {0};
    warm_ups_add(&warm_ups, task('a', false));
    warm_ups_add(&warm_ups, task('b', false));
    warm_ups_note_drawn(&warm_ups, "a");
    assert_string_equal("structures", asked(warm_ups.tasks[0]));
    assert_string_equal("all", asked(warm_ups.tasks[1]));
    json_object_set_new(warm_ups.tasks[0]->question, "warm_up", json_string("programs"));
    warm_ups_note_drawn(&warm_ups, "a"); /* nothing comes back */
    assert_string_equal("programs", asked(warm_ups.tasks[0]));
    warm_ups_drop(&warm_ups, NULL);
}

static bool goes_on(struct render_task *task, const char *left)
{
    json_decref(task->outcome.answer);
    task->outcome.answer = json_pack("{s:s*}", "left", left);
    return warm_up_continue(task);
}

static void one_that_gives_way_goes_on_and_comes_to_an_end(void **state)
{
    (void)state;
    struct render_task *drawn = task('a', false);
    assert_false(goes_on(drawn, NULL)); /* nothing is left */
    for (int i = 1; i < WARM_UP_TRIES; i++) {
        assert_true(goes_on(drawn, "all"));
        assert_string_equal("all", asked(drawn));
        assert_null(drawn->outcome.answer);
    }
    assert_true(goes_on(drawn, "all"));
    assert_string_equal("programs", asked(drawn));
    assert_true(goes_on(drawn, "programs")); /* each compiles one */
    drawn->is_cancelled = true;
    assert_false(goes_on(drawn, "programs"));
    drawn->is_cancelled = false;
    drawn->outcome.problem.code = ERROR_RENDER_FAILED;
    assert_false(goes_on(drawn, "programs"));
    render_task_destroy(drawn);
}

static void what_was_done_is_counted(void **state)
{
    (void)state;
    struct warm_up_totals totals = {0};
    json_t *first = json_pack("{s:s,s:i,s:i}", "left", "all", "pictures", 1, "programs_built", 5);
    json_t *second = json_pack("{s:i,s:i,s:i}", "pictures", 2, "shadow_maps_built", 12,
                               "ray_structures_built", 1);
    warm_up_count(&totals, first);
    warm_up_count(&totals, second);
    warm_up_count(&totals, NULL); /* it failed */
    assert_int_equal(1, totals.interrupted);
    assert_int_equal(3, totals.pictures);
    assert_int_equal(12, totals.shadow_maps_built);
    assert_int_equal(1, totals.ray_structures_built);
    assert_int_equal(5, totals.programs_built);
    json_decref(first);
    json_decref(second);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(too_many_lose_the_least_wanted),
        cmocka_unit_test(a_scene_waits_once_until_it_is_gone),
        cmocka_unit_test(a_scene_that_was_drawn_has_its_structures_left),
        cmocka_unit_test(one_that_gives_way_goes_on_and_comes_to_an_end),
        cmocka_unit_test(what_was_done_is_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

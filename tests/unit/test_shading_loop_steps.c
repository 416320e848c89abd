/* SPDX-License-Identifier: MIT */
/* Room for lights in a shader invocation: as many as fit, never one more. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/shading/loop_steps.h"

/* Of every combination: what there is room for fits, and one light more does not. */
static void room_is_what_fits_and_no_less(void **state)
{
    (void)state;
    static const uint64_t shadowed[] = {0, 1, 10, 4096}, lists[] = {0, 1, 30, 1000, 60000};
    static const uint32_t taps[] = {0, 1, 4, 16}, surfaces[] = {1, 4};
    static const uint64_t besides[] = {0, 20000, 40000, 60000};
    for (int i = 0; i < 4 * 5 * 4 * 2 * 4 * 2; i++) {
        struct loop_lights lights = {.shadowed = shadowed[i % 4],
                                     .longest_list = lists[i / 4 % 5],
                                     .taps = taps[i / 20 % 4],
                                     .surfaces = surfaces[i / 80 % 2],
                                     .besides = besides[i / 160 % 4],
                                     .walks_lists = i / 640 % 2};
        uint64_t room = loop_steps_room(&lights, LOOP_STEPS_MAX);
        assert_true(loop_steps_of_lights(&lights, room) <= LOOP_STEPS_MAX);
        assert_true(loop_steps_of_lights(&lights, room + 1) > LOOP_STEPS_MAX);
    }
}

static void there_is_no_room_beside_too_many_layers(void **state)
{
    (void)state;
    struct loop_lights lights = {.surfaces = 1, .besides = 70000};
    assert_int_equal(loop_steps_room(&lights, LOOP_STEPS_MAX), 0);
}

/* A list that is walked takes a step for each event and tap; one that is searched, for each
 * halving. */
static void lists_cost_what_their_search_costs(void **state)
{
    (void)state;
    struct loop_lights lights = {.shadowed = 1, .taps = 4, .surfaces = 1, .longest_list = 1000};
    uint64_t searched = loop_steps_of_lights(&lights, 1);
    lights.walks_lists = true;
    uint64_t walked = loop_steps_of_lights(&lights, 1);
    assert_true(walked >= 4000 && walked < 4200);
    assert_true(searched > 4 * 10 && searched < 200);
    lights.taps = 0; /* traced: the list is not asked */
    assert_true(loop_steps_of_lights(&lights, 1) < 30);
}

static void points_of_an_area_cost_a_step_each(void **state)
{
    (void)state;
    struct loop_lights lights = {.surfaces = 1, .shadowed = 10};
    uint64_t centre = loop_steps_of_lights(&lights, 10);
    lights.points = 16;
    assert_int_in_range(loop_steps_of_lights(&lights, 10), centre + 10 * 16, centre + 10 * 19);
    lights.points = 4096; /* the most, on four surfaces of a pixel */
    lights.surfaces = 4;
    assert_int_in_range(loop_steps_room(&lights, LOOP_STEPS_MAX), 3, 3);
}

static void a_form_of_an_area_costs_its_sides(void **state)
{
    (void)state;
    struct loop_lights lights = {.surfaces = 1};
    uint64_t centre = loop_steps_of_lights(&lights, 10);
    lights.has_area_form = true;
    assert_int_in_range(loop_steps_of_lights(&lights, 10), centre + 10 * 5 * 17,
                        centre + 10 * 6 * 17);
}

static void layers_are_walked_once_more_around_an_eye_in_a_medium(void **state)
{
    (void)state;
    assert_int_equal(loop_steps_of_layers(20000, false), 20000);
    assert_int_equal(loop_steps_of_layers(20000, true), 40000);
}

static void the_end_of_loops_leaves_room_for_those_not_counted(void **state)
{
    (void)state;
    assert_int_equal(loop_steps_most(65535), LOOP_STEPS_MAX);
    assert_int_equal(loop_steps_most(0), LOOP_STEPS_WATCHDOG);
    for (uint32_t end = 1000; end < LOOP_STEPS_WATCHDOG; end += 1000)
        assert_int_in_range(loop_steps_most(end), end / 10 * 9, end / 100 * 92);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(room_is_what_fits_and_no_less),
        cmocka_unit_test(there_is_no_room_beside_too_many_layers),
        cmocka_unit_test(lists_cost_what_their_search_costs),
        cmocka_unit_test(points_of_an_area_cost_a_step_each),
        cmocka_unit_test(a_form_of_an_area_costs_its_sides),
        cmocka_unit_test(layers_are_walked_once_more_around_an_eye_in_a_medium),
        cmocka_unit_test(the_end_of_loops_leaves_room_for_those_not_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

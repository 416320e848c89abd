/* SPDX-License-Identifier: MIT */
/* What the ground plane makes of light that arrives, and how its shadows end. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "renderer/scene/ground_plane.h"

static const struct scene_state ground = {
    .ground_plane = {.is_there = true, .whole_m = 4, .reach_m = 8}};

static void the_filter_is_the_share_of_light(void **state)
{
    (void)state;
    static const double arriving[3] = {1, 0, 3}, unshadowed[3] = {4, 2, 3};
    static const double none[3] = {0, 0, 0}, more[3] = {5, 2, 3};
    double filter[3];
    ground_plane_filter(&ground, 4, arriving, unshadowed, filter);
    assert_true(filter[0] == 0.25 && filter[1] == 0 && filter[2] == 1);
    ground_plane_filter(&ground, 0, none, none, filter); /* no light at all */
    assert_true(filter[0] == 1 && filter[1] == 1 && filter[2] == 1);
    ground_plane_filter(&ground, 0, more, unshadowed, filter); /* by rounding */
    assert_true(filter[0] == 1);
}

static void shadows_fade_with_the_distance(void **state)
{
    (void)state;
    static const double dark[3] = {0, 0, 0}, light[3] = {1, 1, 1};
    double before = 0, filter[3];
    for (int step = 0; step <= 80; step++) {
        double distance = step / 8.0;
        ground_plane_filter(&ground, distance, dark, light, filter);
        assert_true(filter[0] >= before && filter[0] - before < 0.05);
        assert_true(distance > 4 || filter[0] == 0);
        assert_true(distance < 8 || filter[0] == 1);
        before = filter[0];
    }
    ground_plane_filter(&ground, 6, dark, light, filter);
    assert_true(fabs(filter[0] - 0.5) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_filter_is_the_share_of_light),
        cmocka_unit_test(shadows_fade_with_the_distance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* A light that reaches a visible point is in view; many of the others are not.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/lights/light_reach.h"
#include "tests/support/light_scene.h"

enum { SCENES = 200, POINTS = 200 };

static void check_scene(uint64_t seed, bool is_orthographic, double scale, size_t *reached,
                        size_t *unseen)
{
    static struct light_scene scene;
    struct light_reach reach = {0};
    struct error err = {0};
    uint64_t state = seed + 1;
    light_scene_make(&scene, seed, is_orthographic, scale);
    assert_true(light_reach_collect(&reach, scene.lights, LIGHT_SCENE_LIGHTS, &scene.camera, &err));
    for (int i = 0; i < POINTS; i++) {
        double world[3];
        light_scene_point(&scene, random_uniform(&state, 0, scene.window.width),
                          random_uniform(&state, 0, scene.window.height),
                          light_scene_depth(&scene, &state), world);
        for (int light = 0; light < LIGHT_SCENE_LIGHTS; light++) {
            if (!light_reaches(&scene.lights[light], world))
                continue;
            ++*reached;
            assert_true(reach.is_in_view[light]);
        }
    }
    *unseen += reach.unseen_count;
    light_reach_finish(&reach);
}

static void a_light_that_reaches_a_visible_point_is_in_view(void **unused)
{
    (void)unused;
    size_t reached = 0, unseen = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++)
        check_scene(seed, seed % 2, seed % 3 ? 1 : seed % 4 ? 1e6 : 1e-6, &reached, &unseen);
    assert_true(reached > 10000);
    assert_true(unseen > SCENES); /* and something is gained by it */
}

static void no_lights_are_no_fault(void **unused)
{
    (void)unused;
    static struct light_scene scene;
    struct light_reach reach = {0};
    struct error err = {0};
    light_scene_make(&scene, 7, false, 1);
    assert_true(light_reach_collect(&reach, NULL, 0, &scene.camera, &err));
    assert_int_equal(reach.unseen_count, 0);
    light_reach_finish(&reach);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_light_that_reaches_a_visible_point_is_in_view),
        cmocka_unit_test(no_lights_are_no_fault),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* A light that reaches a point of a visible drawable is in view; many of the others are not. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/lights/light_reach.h"
#include "tests/support/light_scene.h"

enum {
    SCENES = 200,
    POINTS = 200,
    COPIES = 60, /* of every drawable: more than may be tested apart */
};

/* A drawable around a visible point. */
static struct state_item item_around(const double point[3], double radius_m)
{
    struct state_item item = {.radius_m = radius_m * sqrt(3)};
    for (int k = 0; k < 3; k++) {
        item.center[k] = point[k];
        item.bounds_min[k] = point[k] - radius_m;
        item.bounds_max[k] = point[k] + radius_m;
    }
    return item;
}

static void check_scene(uint64_t seed, bool is_orthographic, double scale, size_t copies,
                        size_t *reached, size_t *unseen)
{
    static struct light_scene scene;
    static struct state_item items[POINTS * COPIES];
    static double points[POINTS][3];
    struct light_reach reach = {0};
    struct error err = {0};
    uint64_t state = seed + 1;
    light_scene_make(&scene, seed, is_orthographic, scale);
    for (size_t i = 0; i < POINTS; i++) {
        light_scene_point(&scene, random_uniform(&state, 0, scene.window.width),
                          random_uniform(&state, 0, scene.window.height),
                          light_scene_depth(&scene, &state), points[i]);
        for (size_t k = 0; k < copies; k++)
            items[i * copies + k] =
                item_around(points[i], random_log_uniform(&state, 1e-6, 1e-2) * scale);
    }
    const struct scene_state seen = {.items = items,
                                     .item_count = POINTS * copies,
                                     .lights = scene.lights,
                                     .light_count = LIGHT_SCENE_LIGHTS};
    assert_true(light_reach_collect(&reach, &seen, &scene.camera, &err));
    for (int i = 0; i < POINTS; i++) {
        for (int light = 0; light < LIGHT_SCENE_LIGHTS; light++) {
            if (!light_reaches(&scene.lights[light], points[i]))
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
        check_scene(seed, seed % 2,
                    seed % 3   ? 1
                    : seed % 4 ? 1e6
                               : 1e-6,
                    seed % 8 ? 1 : COPIES, &reached, &unseen);
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
    assert_true(light_reach_collect(&reach, &(struct scene_state){0}, &scene.camera, &err));
    assert_int_equal(reach.unseen_count, 0);
    light_reach_finish(&reach);
}

static size_t count_unseen(const struct scene_state *state, const struct camera *camera)
{
    struct light_reach reach = {0};
    struct error err = {0};
    assert_true(light_reach_collect(&reach, state, camera, &err));
    size_t unseen = reach.unseen_count;
    light_reach_finish(&reach);
    return unseen;
}

/* In the middle of the view, where there is nothing, and where something is. */
static void lights_that_reach_no_drawable_in_view_are_unseen(void **unused)
{
    (void)unused;
    struct camera camera = {
        .right = {1, 0, 0}, .up = {0, 1, 0}, .back = {0, 0, 1}, .half_width = 1, .half_height = 1};
    struct state_light lights[3] = {
        {.type = SCENE_LIGHT_POINT, .position = {0, 0, -10}, .range = 1},
        {.type = SCENE_LIGHT_POINT, .position = {0, 0, -10}}, /* without a bound */
        {.type = SCENE_LIGHT_DIRECTIONAL, .direction = {0, -1, 0}},
    };
    struct state_item item = item_around((const double[3]){0, 0, -12}, 0.9);
    struct scene_state state = {
        .items = &item, .item_count = 1, .lights = lights, .light_count = 3};
    assert_int_equal(count_unseen(&state, &camera), 1);
    item = item_around((const double[3]){0, 0, -12}, 1.1);
    assert_int_equal(count_unseen(&state, &camera), 0);
    item = item_around((const double[3]){0, 0, 9}, 1.1); /* behind the eye */
    assert_int_equal(count_unseen(&state, &camera), 3);
    state.item_count = 0;
    assert_int_equal(count_unseen(&state, &camera), 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_light_that_reaches_a_visible_point_is_in_view),
        cmocka_unit_test(no_lights_are_no_fault),
        cmocka_unit_test(lights_that_reach_no_drawable_in_view_are_unseen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

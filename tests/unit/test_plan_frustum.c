/* SPDX-License-Identifier: MIT */
/* What a window can see is never culled; what lies beside it is. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/frustum.h"
#include "tests/support/light_scene.h"

enum { SCENES = 200, ITEMS = 200 };

static void set_box(struct state_item *item, const double low[3], const double high[3])
{
    double diagonal[3];
    *item = (struct state_item){0};
    vec3_sub(high, low, diagonal);
    item->radius_m = 0.5 * vec3_length(diagonal);
    for (int k = 0; k < 3; k++) {
        item->bounds_min[k] = low[k];
        item->bounds_max[k] = high[k];
        item->center[k] = 0.5 * (low[k] + high[k]);
    }
}

/* A box of up to `side`, in which the point is somewhere. */
static struct state_item box_around(const double point[3], double side, uint64_t *seed)
{
    struct state_item item;
    double low[3], high[3];
    for (int k = 0; k < 3; k++) {
        low[k] = point[k] - random_uniform(seed, 0, side);
        high[k] = point[k] + random_uniform(seed, 0, side);
    }
    set_box(&item, low, high);
    return item;
}

static void a_box_around_a_visible_point_is_never_culled(void **unused)
{
    (void)unused;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        static struct light_scene scene;
        struct frustum frustum;
        uint64_t state = seed + 1;
        double scale = seed % 3 ? 1 : seed % 4 ? 1e6 : 1e-6;
        light_scene_make(&scene, seed, seed % 2, scale);
        frustum_init(&frustum, &scene.camera, &scene.window);
        for (int i = 0; i < ITEMS; i++) {
            double point[3], side = scale * (i % 4 ? random_uniform(&state, 0, 3) : 0);
            light_scene_point(&scene, random_uniform(&state, 0, scene.window.width),
                              random_uniform(&state, 0, scene.window.height),
                              light_scene_depth(&scene, &state), point);
            struct state_item item = box_around(point, side, &state);
            assert_true(frustum_meets(&frustum, &item));
        }
    }
}

/* A point beside the window, further away than the margin of pixels. */
static void a_small_box_beside_the_window_is_culled(void **unused)
{
    (void)unused;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        static struct light_scene scene;
        struct frustum frustum;
        uint64_t state = seed + 1;
        light_scene_make(&scene, seed, seed % 2, 1);
        frustum_init(&frustum, &scene.camera, &scene.window);
        double w = scene.window.width, h = scene.window.height;
        const double beside[4][2] = {{-0.3 * w - 4, 0.5 * h},
                                     {1.3 * w + 4, 0.5 * h},
                                     {0.5 * w, -0.3 * h - 4},
                                     {0.5 * w, 1.3 * h + 4}};
        for (int i = 0; i < 4; i++) {
            double point[3], depth = light_scene_depth(&scene, &state);
            light_scene_point(&scene, beside[i][0], beside[i][1], depth, point);
            struct state_item item = box_around(point, 1e-4 * fabs(depth), &state);
            assert_false(frustum_meets(&frustum, &item));
        }
    }
}

/* A flat box beside the window, whose bounding sphere reaches into it. */
static void a_box_is_culled_where_its_sphere_is_in_view(void **unused)
{
    (void)unused;
    struct camera camera = {.right = {1, 0, 0},
                            .up = {0, 1, 0},
                            .back = {0, 0, 1},
                            .half_width = 1,
                            .half_height = 1,
                            .z_near = 0.1};
    struct frustum frustum;
    struct state_item item;
    frustum_init(&frustum, &camera, &(struct camera_window){0});
    set_box(&item, (double[]){-9, 6, -5}, (double[]){9, 6.1, -4});
    assert_true(item.radius_m > 6); /* the plane at y = 5 is nearer */
    assert_false(frustum_meets(&frustum, &item));
    set_box(&item, (double[]){-9, 4.5, -5}, (double[]){9, 6.1, -4});
    assert_true(frustum_meets(&frustum, &item));
    set_box(&item, (double[]){-9, -9, 0.1}, (double[]){9, 9, 0.2});
    assert_false(frustum_meets(&frustum, &item)); /* behind the eye */
    set_box(&item, (double[]){-9, -9, -0.2}, (double[]){9, 9, 0.2});
    assert_true(frustum_meets(&frustum, &item)); /* around it */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_box_around_a_visible_point_is_never_culled),
        cmocka_unit_test(a_small_box_beside_the_window_is_culled),
        cmocka_unit_test(a_box_is_culled_where_its_sphere_is_in_view),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* Claims about where a line of sight meets a light: the interval holds every lit depth, and is not
 * much longer. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/lights/light_bounds.h"

static const struct camera straight = {.right = {1, 0, 0},
                                       .up = {0, 1, 0},
                                       .back = {0, 0, 1},
                                       .half_width = 1,
                                       .half_height = 1,
                                       .z_near = 0.01};

static uint64_t next_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return *state >> 11;
}

static double uniform(uint64_t *state, double low, double high)
{
    return low + (high - low) * (double)next_random(state) * 0x1p-53;
}

static struct state_light random_light(uint64_t *state)
{
    struct state_light light = {.range = (float)uniform(state, 0.1, 6)};
    light.type = next_random(state) % 2 ? SCENE_LIGHT_SPOT : SCENE_LIGHT_POINT;
    light.outer_cone_rad = (float)exp(uniform(state, log(2e-3), log(M_PI / 2)));
    do {
        for (int i = 0; i < 3; i++) {
            light.position[i] = uniform(state, -5, 5);
            light.direction[i] = uniform(state, -1, 1);
        }
    } while (!vec3_normalize(light.direction));
    light.position[2] -= 5;
    return light;
}

static bool is_lit(const struct state_light *light, const double point[3])
{
    double v[3];
    vec3_sub(point, light->position, v);
    double distance = vec3_length(v);
    return distance < light->range &&
           (light->type == SCENE_LIGHT_POINT ||
            vec3_dot(v, light->direction) >= cos(light->outer_cone_rad) * distance);
}

/* A point of the ray's block at depth z: on the line, or anywhere up to its spread away. */
static void point_of_block(const struct view_ray *ray, double z, uint64_t *state, double out[3])
{
    double spread = ray->spread_m + ray->spread_per_m * z;
    double angle = uniform(state, 0, 2 * M_PI), away = spread * (next_random(state) % 2);
    out[0] = ray->origin[0] + z * ray->slope[0] + away * cos(angle);
    out[1] = ray->origin[1] + z * ray->slope[1] + away * sin(angle);
    out[2] = -z;
}

static void intervals_hold_every_lit_depth(void **unused)
{
    (void)unused;
    uint64_t state = 1;
    struct light_bounds bounds = {0};
    int lit = 0;
    for (int i = 0; i < 20000; i++) {
        struct state_light light = random_light(&state);
        struct error err = {0};
        struct camera camera = straight;
        camera.is_orthographic = i % 2;
        assert_true(light_bounds_collect(&bounds, &light, 1, &camera, &err));
        struct view_ray ray = {0};
        for (int k = 0; k < 2; k++)
            *(camera.is_orthographic ? &ray.origin[k] : &ray.slope[k]) = uniform(&state, -1, 1);
        *(camera.is_orthographic ? &ray.spread_m : &ray.spread_per_m) = uniform(&state, 0, 0.05);
        double front = INFINITY, back = -INFINITY;
        if (bounds.count && !light_bound_interval(&bounds.items[0], &ray, &front, &back))
            front = INFINITY, back = -INFINITY;
        for (int step = 0; step < 100; step++) {
            double z = uniform(&state, camera.is_orthographic ? -8 : 0, 16), point[3];
            point_of_block(&ray, z, &state, point);
            if (!is_lit(&light, point))
                continue;
            lit++;
            assert_true(front <= z && z <= back);
        }
    }
    assert_true(lit > 20000);
    light_bounds_finish(&bounds);
}

/* Lit depths of a thin line by brute force, against the interval. */
static void intervals_are_tight_on_a_line(void **unused)
{
    (void)unused;
    uint64_t state = 5;
    struct light_bounds bounds = {0};
    double lit_m = 0, interval_m = 0;
    for (int i = 0; i < 4000; i++) {
        struct state_light light = random_light(&state);
        struct error err = {0};
        assert_true(light_bounds_collect(&bounds, &light, 1, &straight, &err));
        struct view_ray ray = {.slope = {uniform(&state, -1, 1), uniform(&state, -1, 1)}};
        double front, back;
        if (bounds.count && light_bound_interval(&bounds.items[0], &ray, &front, &back))
            interval_m += back - front;
        for (double z = 0.02; z < 16; z += 0.04) {
            double point[3] = {z * ray.slope[0], z * ray.slope[1], -z};
            lit_m += is_lit(&light, point) ? 0.04 : 0;
        }
    }
    assert_true(interval_m < 1.1 * lit_m);
    assert_true(interval_m > 0.99 * lit_m);
    light_bounds_finish(&bounds);
}

static void bounding_spheres_of_cones_hold_apex_rim_and_cap(void **unused)
{
    (void)unused;
    struct light_bounds bounds = {0};
    struct error err = {0};
    for (int degrees = 1; degrees < 90; degrees++) {
        double angle = degrees * M_PI / 180;
        struct state_light light = {.type = SCENE_LIGHT_SPOT,
                                    .position = {0, 0, -9},
                                    .range = 3,
                                    .direction = {1, 0, 0},
                                    .outer_cone_rad = (float)angle};
        assert_true(light_bounds_collect(&bounds, &light, 1, &straight, &err));
        const struct light_bound *bound = &bounds.items[0];
        for (int k = 0; k <= 20; k++) {
            double phi = angle * k / 20;
            double cap[3] = {3 * cos(phi), 3 * sin(phi), 9}, away[3];
            vec3_sub(cap, bound->center, away);
            assert_true(vec3_length(away) <= bound->radius_m);
        }
        double apex[3] = {0, 0, 9}, away[3];
        vec3_sub(apex, bound->center, away);
        assert_true(vec3_length(away) <= bound->radius_m);
        assert_true(bound->radius_m < 3.01);
    }
    light_bounds_finish(&bounds);
}

static void lights_without_a_usable_bound_are_global(void **unused)
{
    (void)unused;
    struct light_bounds bounds = {0};
    struct error err = {0};
    struct state_light lights[] = {
        {.type = SCENE_LIGHT_DIRECTIONAL, .range = 3},
        {.type = SCENE_LIGHT_POINT},
        {.type = SCENE_LIGHT_SPOT, .range = INFINITY},
        {.type = SCENE_LIGHT_POINT, .range = 1, .position = {NAN, 0, 0}},
        {.type = SCENE_LIGHT_POINT, .range = 1, .position = {0, 0, -1}},
        {.type = SCENE_LIGHT_POINT, .range = 1e-38f, .position = {0, 0, -1e30}},
    };
    assert_true(light_bounds_collect(&bounds, lights, 6, &straight, &err));
    assert_int_equal(bounds.global_count, 4);
    assert_int_equal(bounds.count, 2);
    assert_int_equal(bounds.items[0].light, 4);
    assert_int_equal(bounds.items[1].light, 5);
    light_bounds_finish(&bounds);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(intervals_hold_every_lit_depth),
        cmocka_unit_test(intervals_are_tight_on_a_line),
        cmocka_unit_test(bounding_spheres_of_cones_hold_apex_rim_and_cap),
        cmocka_unit_test(lights_without_a_usable_bound_are_global),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

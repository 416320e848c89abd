/* SPDX-License-Identifier: MIT */
/* Where shadows are asked for: on casters themselves, across the seams of cubes, far from the
 * origin, at any scale. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "tests/support/shadow_rig.h"

static struct shadow_rig rig;
static const double no_eye[3] = {0, 0, 0};

static void prepare(const struct pane_scene *panes, const struct view_light *lights, size_t count,
                    const double eye[3], const struct view_quality *quality)
{
    struct error err = {0};
    if (!shadow_rig_prepare(&rig, panes, lights, count, eye, quality, &err))
        fail_msg("%s", err.message);
}

static double symmetric(uint64_t *seed)
{
    return 2 * rig_random(seed) - 1;
}

static void lean(struct pane *pane, const double n[3], double half)
{
    double helper[3] = {0, 0, 0};
    helper[fabs(n[0]) < 0.5 ? 0 : 1] = half;
    vec3_cross(n, helper, pane->u);
    vec3_normalize(pane->u);
    vec3_cross(n, pane->u, pane->v);
    vec3_normalize(pane->v);
    for (int k = 0; k < 3; k++) {
        pane->u[k] *= half;
        pane->v[k] *= half;
    }
}

/* Points well inside a pane: every tap meets the pane's own plane. */
static void points_on(const struct pane *pane, int count, double (*points)[3], uint64_t *seed)
{
    for (int i = 0; i < count; i++) {
        double a = 0.6 * symmetric(seed), b = 0.6 * symmetric(seed);
        for (int k = 0; k < 3; k++)
            points[i][k] = pane->center[k] + a * pane->u[k] + b * pane->v[k];
    }
}

/* No bias and no acne: up to 88 degrees from the light's direction, at the
 * outermost tap, a surface never shadows itself,
 * whatever its kind. */
static void no_surface_shadows_itself(void **state)
{
    (void)state;
    enum { POINTS = 200 };
    const struct view_light lights[] = {
        {.type = SCENE_LIGHT_DIRECTIONAL,
         .direction = {0, -1, 0},
         .color = {1, 1, 1},
         .intensity = 1},
        {.type = SCENE_LIGHT_POINT, .position = {0.3, 6, 0.2}, .color = {1, 1, 1}, .intensity = 1},
        {.type = SCENE_LIGHT_SPOT,
         .position = {0.3, 6, 0.2},
         .direction = {0, -1, 0},
         .color = {1, 1, 1},
         .intensity = 1,
         .outer_cone_deg = 50},
        {.type = SCENE_LIGHT_SPOT,
         .position = {0.3, 6, 0.2},
         .direction = {0, -1, 0},
         .color = {1, 1, 1},
         .intensity = 1,
         .outer_cone_deg = 75},
    };
    uint64_t seed = 21;
    int lit = 0;
    for (int round = 0; round < 60; round++) {
        double angle = 88.0 / 57.29578 * rig_random(&seed), turn = 6.283 * rig_random(&seed);
        double n[3] = {sin(angle) * cos(turn), cos(angle), sin(angle) * sin(turn)};
        double far_away = round % 3 == 2 ? 1e7 : 0,
               eye[3] = {far_away + symmetric(&seed), 2, far_away};
        struct view_light moved[4];
        struct pane_scene panes = {0};
        struct pane pane = {
            .center = {far_away, 0, far_away}, .color = {0.5f, 0.5f, 0.5f}, .is_opaque = round % 2};
        double points[POINTS][3];
        float t[POINTS][4];
        lean(&pane, n, 3);
        pane_scene_add(&panes, &pane);
        for (int i = 0; i < 4; i++) {
            moved[i] = lights[i];
            moved[i].position[0] += far_away;
            moved[i].position[2] += far_away;
        }
        static const int resolutions[] = {64, 333, 1024};
        shadow_system_forget(rig.shadows, "panes");
        prepare(&panes, moved, 4, eye,
                &(struct view_quality){.shadow_resolution = resolutions[round % 3],
                                       .shadow_taps = round % 5 ? 4 : 16});
        points_on(&pane, POINTS, points, &seed);
        for (uint32_t light = 0; light < 4; light++) {
            shadow_rig_query(&rig, light, (const double(*)[3])points, n, POINTS, UINT32_MAX, t);
            for (int i = 0; i < POINTS; i++) {
                double ray[3], cosine;
                vec3_sub(moved[light].position, points[i], ray);
                cosine = light == 0 ? n[1] : vec3_dot(n, ray) / vec3_length(ray);
                if (fabs(cosine) < 0.035 + 6.0 / rig.quality.shadow_resolution)
                    continue;
                lit++;
                if (t[i][0] != 1)
                    fail_msg("light %u, %.1f degrees, %s, at %g %g %g: %g", light, angle * 57.3,
                             pane.is_opaque ? "opaque" : "transparent", points[i][0], points[i][1],
                             points[i][2], (double)t[i][0]);
            }
        }
        pane_scene_finish(&panes);
    }
    assert_true(lit > 40000);
}

static int count_dark(const double (*points)[3], int count, const double n[3])
{
    enum { MOST = 500 };
    float t[MOST][4];
    int dark = 0;
    assert_true(count <= MOST);
    shadow_rig_query(&rig, 0, points, n, (uint32_t)count, UINT32_MAX, t);
    for (int i = 0; i < count; i++)
        dark += t[i][0] < 1;
    return dark;
}

/* Two panes meet in a valley. Beside its bottom a texel's centre lies below the other pane, which
 * rises above the receiver's plane: a false shadow but for the tolerance, which is one of texels
 * and not so wide that it loses a caster some texels away. */
static void creases_cast_no_shadow_on_their_own_sides(void **state)
{
    (void)state;
    enum { POINTS = 500 };
    static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                          .direction = {0, -1, 0},
                                          .color = {1, 1, 1},
                                          .intensity = 1};
    const double slope = 0.3, texel_m = 4.1 / 60, n[3] = {slope, 1, 0}; /* of the left pane */
    for (int opaque = 0; opaque < 2; opaque++) {
        struct pane_scene panes = {0};
        for (int side = -1; side <= 1; side += 2) {
            double half = side < 0 ? 1 : 1.05; /* the bottom lies a quarter off a texel's centre */
            struct pane pane = {.center = {side * half, slope * half, 0},
                                .u = {half, side * slope * half, 0},
                                .v = {0, 0, -2},
                                .color = {0.5f, 0.5f, 0.5f},
                                .is_opaque = opaque};
            pane_scene_add(&panes, &pane);
        }
        double points[POINTS][3];
        uint64_t seed = 31;
        for (int i = 0; i < POINTS; i++) {
            points[i][0] = -texel_m * rig_random(&seed);
            points[i][1] = -slope * points[i][0];
            points[i][2] = symmetric(&seed);
        }
        for (int taps = 1; taps <= 4; taps += 3) {
            const struct view_quality quality = {.shadow_resolution = 64, .shadow_taps = taps};
            prepare(&panes, &sun, 1, no_eye, &quality);
            assert_true(count_dark((const double(*)[3])points, POINTS, n) > POINTS / 10);
            rig.tolerance[opaque ? 0 : 1] = 1;
            assert_int_equal(count_dark((const double(*)[3])points, POINTS, n), 0);
            rig.tolerance[0] = rig.tolerance[1] = 0;
        }
        struct pane near_by = {.center = {0, 6 * texel_m, 0},
                               .u = {1, 0, 0},
                               .v = {0, 0, -2},
                               .color = {0.5f, 0.5f, 0.5f},
                               .is_opaque = opaque};
        pane_scene_add(&panes, &near_by);
        prepare(&panes, &sun, 1, no_eye, &(struct view_quality){.shadow_resolution = 64});
        rig.tolerance[0] = rig.tolerance[1] = 1;
        assert_int_equal(count_dark((const double(*)[3])points, POINTS, n), POINTS);
        rig.tolerance[0] = rig.tolerance[1] = 0;
        pane_scene_finish(&panes);
    }
}

/* A pane all around the light, as a cube would see its own edges: every direction is filtered once.
 */
static void cube_seams_do_not_show(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    for (int face = 0; face < 6; face++) {
        double n[3] = {0.31, 0.37, 0.33}; /* no pane is parallel to a face of the map */
        n[face / 2] += face % 2 ? -2 : 2;
        vec3_normalize(n);
        struct pane pane = {.color = {0.5f, 0.25f, 0.125f}};
        for (int k = 0; k < 3; k++)
            pane.center[k] = 2 * n[k];
        lean(&pane, n, 0.01);
        pane_scene_add(&panes, &pane);
    }
    struct pane wall = {.center = {2, 0, 0}, .color = {0.5f, 0.25f, 0.125f}};
    double n[3] = {1, 1, 0.9};
    vec3_normalize(n);
    for (int k = 0; k < 3; k++)
        wall.center[k] = 1.5 * n[k];
    lean(&wall, n, 20); /* crosses three faces and their corner */
    pane_scene_add(&panes, &wall);
    const struct view_light lamp = {.type = SCENE_LIGHT_POINT, .color = {1, 1, 1}, .intensity = 1};
    uint64_t seed = 4;
    for (int taps = 1; taps <= 16; taps *= 4) {
        prepare(&panes, &lamp, 1, no_eye,
                &(struct view_quality){.shadow_resolution = 37, .shadow_taps = taps});
        for (int i = 0; i < 2000; i++) {
            /* directions on and beside the seams x = y, y = z, x = z */
            double d[3] = {1, 1, 1}, point[1][3], off = 0.03 * symmetric(&seed);
            d[i % 3] = 0.7 + 0.3 * rig_random(&seed);
            d[(i + 1) % 3] += off;
            for (int k = 0; k < 3; k++)
                point[0][k] = d[k] * 4 / vec3_dot(n, d);
            float t[1][4];
            shadow_rig_query(&rig, 0, (const double(*)[3])point, n, 1, UINT32_MAX, t);
            if (fabsf(t[0][0] - 0.5f) > 1e-6f || fabsf(t[0][2] - 0.125f) > 1e-6f)
                fail_msg("%d taps, direction %g %g %g: %g", taps, d[0], d[1], d[2],
                         (double)t[0][0]);
        }
    }
    pane_scene_finish(&panes);
}

/* The same scene at 1e-6 to 1e6 times its size, and 1e7 m away: the same answers. */
static void scale_and_place_do_not_matter(void **state)
{
    (void)state;
    enum { POINTS = 400 };
    float first[3][POINTS][4], t[POINTS][4];
    int different = 0;
    for (int step = 0; step <= 14; step++) {
        double scale = step < 14 ? pow(10, step < 1 ? 0 : step - 7) : 1, away = step < 14 ? 0 : 1e7;
        struct pane_scene panes = {0};
        uint64_t seed = 8;
        for (int i = 0; i < 30; i++) {
            struct pane pane = {.is_opaque = i % 7 == 6};
            double n[3];
            for (int k = 0; k < 3; k++) {
                pane.center[k] =
                    (2 * symmetric(&seed) + (k == 1 ? 3 : 0)) * scale + (k == 0 ? away : 0);
                pane.color[k] = (float)rig_random(&seed);
                n[k] = symmetric(&seed);
            }
            vec3_normalize(n);
            lean(&pane, n, (0.3 + rig_random(&seed)) * scale);
            pane_scene_add(&panes, &pane);
        }
        struct view_light lights[] = {
            {.type = SCENE_LIGHT_DIRECTIONAL,
             .direction = {0.2, -1, 0.1},
             .color = {1, 1, 1},
             .intensity = 1},
            {.type = SCENE_LIGHT_POINT,
             .position = {away, 8 * scale, scale},
             .color = {1, 1, 1},
             .intensity = 1},
            {.type = SCENE_LIGHT_SPOT,
             .position = {away, 8 * scale, scale},
             .direction = {0, -1, 0},
             .color = {1, 1, 1},
             .intensity = 1,
             .outer_cone_deg = 40},
        };
        double points[POINTS][3], eye[3] = {away, scale, 4 * scale}, up[3] = {0.1, 1, 0.2};
        for (int i = 0; i < POINTS; i++)
            for (int k = 0; k < 3; k++)
                points[i][k] =
                    (2 * symmetric(&seed) + (k == 1 ? 2 : 0)) * scale + (k == 0 ? away : 0);
        prepare(&panes, lights, 3, eye,
                &(struct view_quality){.shadow_resolution = 128, .shadow_taps = 16});
        for (uint32_t light = 0; light < 3; light++) {
            shadow_rig_query(&rig, light, (const double(*)[3])points, up, POINTS, UINT32_MAX, t);
            if (step == 0)
                memcpy(first[light], t, sizeof t);
            for (int i = 0; i < POINTS; i++)
                different += fabsf(t[i][0] - first[light][i][0]) > 1e-3f;
        }
        pane_scene_finish(&panes);
    }
    /* texels whose centre lies on an edge may fall to either side */
    print_message("%d of %d answers differ\n", different, 14 * 3 * POINTS);
    assert_true(different < 14 * 3 * POINTS / 500);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_surface_shadows_itself),
        cmocka_unit_test(creases_cast_no_shadow_on_their_own_sides),
        cmocka_unit_test(cube_seams_do_not_show),
        cmocka_unit_test(scale_and_place_do_not_matter),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}

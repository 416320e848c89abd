/* SPDX-License-Identifier: MIT */
/* Deep shadow maps against closed forms and against their definition in f64. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/shadow_rig.h"

static struct shadow_rig rig;
static const double up[3] = {0, 1, 0};
static const double no_eye[3] = {0, 0, 0};

static void prepare(const struct pane_scene *panes, const struct view_light *lights, size_t count,
                    const struct view_quality *quality)
{
    struct error err = {0};
    if (!shadow_rig_prepare(&rig, panes, lights, count, no_eye, quality, &err))
        fail_msg("%s", err.message);
}

static struct pane level_pane(double height, double half, float r, float g, float b)
{
    return (struct pane){
        .center = {0, height, 0}, .u = {half, 0, 0}, .v = {0, 0, -half}, .color = {r, g, b}};
}

static void n_parallel_panes_give_the_product_after_each_pane(void **state)
{
    (void)state;
    for (int n = 1; n <= 64; n = n < 4 ? n + 1 : 2 * n) {
        struct pane_scene panes = {0};
        double product[65][3] = {{1, 1, 1}};
        uint64_t seed = (uint64_t)n;
        for (int i = 0; i < n; i++) {
            struct pane pane =
                level_pane(5 - 4.0 * i / n, 3, (float)(0.8 + 0.2 * rig_random(&seed)),
                           (float)(0.9 + 0.09 * rig_random(&seed)), (float)rig_random(&seed));
            pane_scene_add(&panes, &pane);
            for (int k = 0; k < 3; k++)
                product[i + 1][k] = product[i][k] * (double)pane.color[k];
        }
        pane_scene_add(
            &panes, &(struct pane){
                        .center = {0, 0, 0}, .u = {4, 0, 0}, .v = {0, 0, -4}, .is_opaque = true});
        for (int taps = 1; taps <= 16; taps = taps == 1 ? 4 : taps == 4 ? 9 : taps == 9 ? 16 : 17) {
            prepare(&panes, shadow_rig_lamps, SHADOW_RIG_LAMPS,
                    &(struct view_quality){.shadow_resolution = 64, .shadow_taps = taps});
            for (uint32_t light = 0; light < 3; light++) {
                for (int i = 0; i <= n; i++) {
                    double height = i < n ? 5 - 4.0 * i / n : 0;
                    double point[1][3] = {{0.37, height, -0.21}};
                    float t[1][4];
                    shadow_rig_query(&rig, light, point, up, 1, UINT32_MAX, t);
                    for (int k = 0; k < 3; k++)
                        if (fabs((double)t[0][k] - product[i][k]) > 1e-6)
                            fail_msg("light %u, %d panes, %d taps, after %d: %.9g, not %.9g", light,
                                     n, taps, i, (double)t[0][k], product[i][k]);
                }
            }
        }
        assert_int_equal(rig.report.counts.longest_list, n);
        pane_scene_finish(&panes);
    }
}

static double symmetric(uint64_t *seed)
{
    return 2 * rig_random(seed) - 1;
}

static void add_random_panes(struct pane_scene *panes, int count, uint64_t *seed)
{
    for (int i = 0; i < count; i++) {
        struct pane pane = {.is_opaque = i % 8 == 7};
        double size = pane.is_opaque ? 0.6 : 1.5;
        for (int k = 0; k < 3; k++) {
            pane.center[k] = 2.5 * symmetric(seed) + (k == 1 ? 4 : 0);
            pane.u[k] = size * symmetric(seed);
            pane.v[k] = size * symmetric(seed);
            pane.color[k] = rig_random(seed) < 0.1 ? 0 : (float)rig_random(seed);
        }
        /* make v perpendicular to u */
        double along = 0, square = 1e-9;
        for (int k = 0; k < 3; k++) {
            along += pane.u[k] * pane.v[k];
            square += pane.u[k] * pane.u[k];
        }
        for (int k = 0; k < 3; k++)
            pane.v[k] -= along / square * pane.u[k];
        pane.pass_through = i % 5 == 2 ? SCENE_PASS_SLAB : SCENE_PASS_CONSTANT;
        pane_scene_add(panes, &pane);
    }
}

/* Returns the points compared. */
static int compare_with_model(uint32_t light, int count, uint64_t *seed, double tolerance,
                              double *worst)
{
    int compared = 0;
    for (int i = 0; i < count; i++) {
        double point[1][3], normal[3], expected[3];
        float t[1][4];
        for (int k = 0; k < 3; k++) {
            point[0][k] = 3 * symmetric(seed) + (k == 1 ? 3 : 0);
            normal[k] = symmetric(seed);
        }
        if (!shadow_rig_model(&rig, light, point[0], normal, expected))
            continue;
        shadow_rig_query(&rig, light, point, normal, 1, UINT32_MAX, t);
        compared++;
        for (int k = 0; k < 3; k++) {
            double error = fabs((double)t[0][k] - expected[k]);
            *worst = fmax(*worst, error);
            if (!(error <= tolerance))
                fail_msg("light %u at %g %g %g, channel %d: %.9g, not %.9g", light, point[0][0],
                         point[0][1], point[0][2], k, (double)t[0][k], expected[k]);
        }
    }
    return compared;
}

static void random_panes_agree_with_the_definition_in_f64(void **state)
{
    (void)state;
    static const int taps[] = {1, 4, 9, 16};
    for (int round = 0; round < 4; round++) {
        uint64_t seed = 77 + (uint64_t)round;
        struct pane_scene panes = {0};
        add_random_panes(&panes, 40, &seed);
        prepare(&panes, shadow_rig_lamps, SHADOW_RIG_LAMPS,
                &(struct view_quality){.shadow_resolution = 128, .shadow_taps = taps[round]});
        for (uint32_t light = 0; light < 3; light++) {
            double worst = 0;
            /* between texels the weights carry the rounding of f32 map coordinates */
            double tolerance = taps[round] == 1 ? 2e-6 : 4e-5;
            int compared = compare_with_model(light, 1500, &seed, tolerance, &worst);
            print_message("light %u, %2d taps: %d points, largest error %.2g\n", light, taps[round],
                          compared, worst);
            assert_true(compared > 300);
        }
        pane_scene_finish(&panes);
    }
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(n_parallel_panes_give_the_product_after_each_pane),
        cmocka_unit_test(random_panes_agree_with_the_definition_in_f64),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}

/* SPDX-License-Identifier: MIT */
/* Stochastic shadow maps, grey and coloured: free of bias at every depth, with no more noise than
 * independent samples have, and with the same noise every time. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/shadow_map.h"
#include "tests/support/shadow_rig.h"

enum { POINTS = 4000, RESOLUTION = 512 };
static struct shadow_rig rig;
static double points[POINTS][3];
static float found[POINTS][4], again[POINTS][4];

static void prepare_form(const struct pane_scene *panes, enum shadow_technique shadows, int taps,
                         bool faithful)
{
    const struct view_quality quality = {.shadows = shadows,
                                         .faithful = faithful,
                                         .shadow_resolution = RESOLUTION,
                                         .shadow_taps = taps};
    shadow_rig_prepare_lamps(&rig, panes, &quality);
}

static void prepare(const struct pane_scene *panes, enum shadow_technique shadows, int taps)
{
    prepare_form(panes, shadows, taps, false);
}

static void ask(uint32_t light, float (*out)[4])
{
    shadow_rig_ask(&rig, light, (const double(*)[3])points, POINTS, out);
}

/* Below the middle of the sheets, for every light. */
static void choose_points(double y)
{
    rig_random_points(points, POINTS, 1.2, y, y);
}

struct spread {
    double mean, deviation;
};

static struct spread measure(int channel, double expected)
{
    struct spread s = {0, 0};
    for (int i = 0; i < POINTS; i++) {
        double t = (double)found[i][channel];
        s.mean += t / POINTS;
        s.deviation += (t - expected) * (t - expected) / POINTS;
    }
    s.deviation = sqrt(s.deviation);
    return s;
}

/* Of S independent samples, sqrt(T (1 - T) / S). The tent weighs 64 taps as 34 to 37 alike; of one
 * surface, whose numbers are stratified, they are as good as 64. */
static double bound_of(enum shadow_technique shadows, double t, int layers)
{
    double samples = (shadows == SHADOWS_STOCHASTIC ? 4 : 1) * (layers > 1 ? 34 : 64);
    return sqrt(t * (1 - t) / samples);
}

static void expect_at(enum shadow_technique shadows, double y, int layers, const double expected[3])
{
    choose_points(y);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        ask(light, found);
        for (int k = 0; k < 3; k++) {
            double bound = bound_of(shadows, expected[k], layers);
            struct spread s = measure(k, expected[k]);
            print_message("%s, light %u, y %g: T %.4f, mean %.4f, deviation %.4f, bound %.4f\n",
                          shadow_technique_name((int)shadows), light, y, expected[k], s.mean,
                          s.deviation, bound);
            assert_true(fabs(s.mean - expected[k]) <= 0.2 * bound + 1e-6);
            assert_true(s.deviation <= bound + 1e-6);
        }
    }
}

static double gray_of(const float c[3])
{
    return 0.2126 * (double)c[0] + 0.7152 * (double)c[1] + 0.0722 * (double)c[2];
}

static const float upper[3] = {0.5f, 0.25f, 0.9f}, lower[3] = {0.7f, 0.5f, 0.125f};
static const double one[3] = {1, 1, 1};

static void colored_layers_are_right_within_the_noise(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    double first[3], both[3];
    pane_scene_add_sheet(&panes, 2, upper);
    pane_scene_add_sheet(&panes, 1, lower);
    for (int k = 0; k < 3; k++) {
        first[k] = (double)upper[k];
        both[k] = (double)upper[k] * (double)lower[k];
    }
    prepare(&panes, SHADOWS_COLORED_STOCHASTIC, 64);
    expect_at(SHADOWS_COLORED_STOCHASTIC, 2.5, 0, one);
    expect_at(SHADOWS_COLORED_STOCHASTIC, 2, 0, one); /* no surface shadows itself */
    expect_at(SHADOWS_COLORED_STOCHASTIC, 1.5, 1, first);
    expect_at(SHADOWS_COLORED_STOCHASTIC, 1, 1, first);
    expect_at(SHADOWS_COLORED_STOCHASTIC, 0, 2, both);
    pane_scene_finish(&panes);
}

static void gray_layers_are_right_within_the_noise(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    double first[3], both[3];
    pane_scene_add_sheet(&panes, 2, upper);
    pane_scene_add_sheet(&panes, 1, lower);
    for (int k = 0; k < 3; k++) {
        first[k] = gray_of(upper);
        both[k] = gray_of(upper) * gray_of(lower);
    }
    prepare(&panes, SHADOWS_STOCHASTIC, 64);
    expect_at(SHADOWS_STOCHASTIC, 2, 0, one);
    expect_at(SHADOWS_STOCHASTIC, 1, 1, first);
    expect_at(SHADOWS_STOCHASTIC, 0, 2, both);
    for (int i = 0; i < POINTS; i++)
        assert_true(found[i][0] == found[i][1] && found[i][1] == found[i][2]);
    pane_scene_finish(&panes);
}

/* One sample of each texel, not stratified: right in the mean, and noisy by the bound of as many
 * samples as the tent has, where the default has less than half of that. */
static void the_published_form_has_the_noise_of_one_sample(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    double t = gray_of(upper), bound = sqrt(t * (1 - t) / 34);
    pane_scene_add_sheet(&panes, 2, upper);
    choose_points(0);
    for (int faithful = 0; faithful < 2; faithful++) {
        shadow_rig_prepare_lamps(&rig, &panes,
                                 &(struct view_quality){.shadows = SHADOWS_STOCHASTIC,
                                                        .faithful = faithful,
                                                        .shadow_resolution = RESOLUTION,
                                                        .shadow_taps = 64});
        for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
            ask(light, found);
            struct spread s = measure(0, t);
            print_message("%s, light %u: mean %.4f of %.4f, deviation %.4f of %.4f\n",
                          faithful ? "one sample" : "four samples", light, s.mean, t, s.deviation,
                          bound);
            assert_true(fabs(s.mean - t) <= 0.2 * bound);
            assert_true(faithful ? s.deviation > 0.8 * bound && s.deviation < 1.1 * bound
                                 : s.deviation < 0.5 * bound);
        }
    }
    pane_scene_finish(&panes);
}

/* Of a face of the point light the points see some 60 windows of 8 x 8 texels, so that the
 * correlation of what is independent deviates by an eighth. */
static double correlation(int a, int b, const double mean[3])
{
    double both = 0, of_a = 0, of_b = 0;
    for (int i = 0; i < POINTS; i++) {
        double off_a = (double)found[i][a] - mean[a], off_b = (double)found[i][b] - mean[b];
        both += off_a * off_b;
        of_a += off_a * off_a;
        of_b += off_b * off_b;
    }
    return both / sqrt(of_a * of_b);
}

static void expect_one_sample(uint32_t light, const double t[3], bool faithful)
{
    for (int k = 0; k < 3; k++) {
        double bound = sqrt(t[k] * (1 - t[k]) / 34);
        struct spread s = measure(k, t[k]);
        print_message("light %u, channel %d, %s: mean %.4f of %.4f, deviation %.4f of %.4f\n",
                      light, k, faithful ? "CSSM1" : "CSSM2", s.mean, t[k], s.deviation, bound);
        assert_true(fabs(s.mean - t[k]) <= 0.2 * bound);
        assert_true(s.deviation < (faithful ? 1.1 : 0.8) * bound);
        assert_true(!faithful || s.deviation > 0.8 * bound);
    }
}

/* CSSM1: a map for each wavelength. One sample of each texel, not stratified, and what is left to
 * chance in one wavelength tells nothing of the others: grey glass has coloured grain. */
static void each_wavelength_has_a_noise_of_its_own(void **state)
{
    (void)state;
    static const float grey[3] = {0.5f, 0.5f, 0.5f};
    const double tests[2][3] = {{0.5, 0.25, 0.9f}, {0.5, 0.5, 0.5}};
    for (int test = 0; test < 2; test++) {
        struct pane_scene panes = {0};
        pane_scene_add_sheet(&panes, 2, test ? grey : upper);
        for (int faithful = 0; faithful < 2; faithful++) {
            prepare_form(&panes, SHADOWS_COLORED_STOCHASTIC, 64, faithful);
            for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
                choose_points(0);
                ask(light, found);
                expect_one_sample(light, tests[test], faithful);
                for (int k = 0; k < 3; k++)
                    assert_true(fabs(correlation(k, (k + 1) % 3, tests[test])) < 0.4);
                choose_points(2); /* on the pane */
                ask(light, found);
                for (int i = 0; i < POINTS; i++)
                    assert_true(found[i][0] == 1 && found[i][1] == 1 && found[i][2] == 1);
            }
        }
        pane_scene_finish(&panes);
    }
}

static void wavelengths_are_right_behind_each_of_two_panes(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    pane_scene_add_sheet(&panes, 2, upper);
    pane_scene_add_sheet(&panes, 1, lower);
    prepare_form(&panes, SHADOWS_COLORED_STOCHASTIC, 64, true);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
        for (int y = 1; y >= 0; y--) {
            choose_points(y);
            ask(light, found);
            for (int k = 0; k < 3; k++) {
                double t = (double)upper[k] * (y ? 1 : (double)lower[k]);
                double bound = sqrt(t * (1 - t) / 34);
                struct spread s = measure(k, t);
                assert_true(fabs(s.mean - t) <= 0.2 * bound && s.deviation <= 1.1 * bound);
            }
        }
    pane_scene_finish(&panes);
}

/* In the code of the source equal coordinates share one random number, and n panes filter as one.
 */
static void panes_in_one_place_are_independent(void **state)
{
    (void)state;
    static const float half[3] = {0.5f, 0.8f, 0.9f};
    struct pane_scene panes = {0};
    double product[3];
    for (int i = 0; i < 3; i++)
        pane_scene_add_sheet(&panes, 1, half);
    for (int k = 0; k < 3; k++)
        product[k] = pow((double)half[k], 3);
    prepare(&panes, SHADOWS_COLORED_STOCHASTIC, 64);
    expect_at(SHADOWS_COLORED_STOCHASTIC, 0, 3, product);
    pane_scene_finish(&panes);
}

static void all_and_nothing_are_exact(void **state)
{
    (void)state;
    static const float clear_dark[3] = {0, 1, 0};
    struct pane_scene panes = {0};
    choose_points(0);
    for (int i = 0; i < 20; i++)
        pane_scene_add_sheet(&panes, 1 + 0.05 * i, clear_dark);
    prepare(&panes, SHADOWS_COLORED_STOCHASTIC, 16);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        ask(light, found);
        for (int i = 0; i < POINTS; i++)
            assert_true(found[i][0] == 0 && found[i][1] == 1 && found[i][2] == 0);
    }
    pane_scene_finish(&panes);
}

/* One face after the other and all at once, again and again. */
static void noise_has_the_same_bits_every_time(void **state)
{
    (void)state;
    static const enum shadow_technique techniques[] = {SHADOWS_STOCHASTIC,
                                                       SHADOWS_COLORED_STOCHASTIC};
    struct pane_scene panes = {0};
    pane_scene_add_sheet(&panes, 2, upper);
    pane_scene_add_sheet(&panes, 1, lower);
    choose_points(0);
    for (int t = 0; t < 2; t++)
        for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
            for (int round = 0; round < 3; round++) {
                rig.shadows = rig.systems[round % 2];
                shadow_system_forget(rig.shadows, "panes");
                prepare(&panes, techniques[t], 4);
                ask(light, round ? again : found);
                assert_true(!round || !memcmp(found, again, sizeof found));
            }
    rig.shadows = rig.systems[0];
    pane_scene_finish(&panes);
}

/* As in a stream of frames. */
static void noise_stands_still_while_something_else_moves(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct pane floor = {.center = {0, -2, 0}, .u = {6, 0, 0}, .v = {0, 0, 6}, .is_opaque = true};
    struct pane moved = {.center = {4, 0.5, 4}, .u = {0.3, 0, 0}, .v = {0, 0, 0.3}};
    pane_scene_add(&panes, &floor);
    pane_scene_add_sheet(&panes, 2, upper);
    uint32_t index = pane_scene_add(&panes, &moved);
    choose_points(0);
    prepare(&panes, SHADOWS_COLORED_STOCHASTIC, 4);
    ask(1, found); /* the point light */
    moved.center[1] = 0.7;
    pane_scene_set(&panes, index, &moved);
    prepare(&panes, SHADOWS_COLORED_STOCHASTIC, 4);
    assert_true(rig.report.counts.shadow_maps_built > 0);
    ask(1, again);
    assert_memory_equal(found, again, sizeof found);
    pane_scene_finish(&panes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colored_layers_are_right_within_the_noise),
        cmocka_unit_test(gray_layers_are_right_within_the_noise),
        cmocka_unit_test(the_published_form_has_the_noise_of_one_sample),
        cmocka_unit_test(each_wavelength_has_a_noise_of_its_own),
        cmocka_unit_test(wavelengths_are_right_behind_each_of_two_panes),
        cmocka_unit_test(panes_in_one_place_are_independent),
        cmocka_unit_test(all_and_nothing_are_exact),
        cmocka_unit_test(noise_has_the_same_bits_every_time),
        cmocka_unit_test(noise_stands_still_while_something_else_moves),
    };
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}

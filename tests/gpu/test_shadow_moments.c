/* SPDX-License-Identifier: MIT */
/* Moments of absorbance: exact on, between and behind one or two panes and behind any number of
 * them; between three and more what double precision makes of the moments, and near the exact
 * light. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/shadow_map.h"
#include "renderer/shadows/shadow_texels.h"
#include "renderer/shadows/shadows.h"
#include "tests/support/shadow_rig.h"

enum { POINTS = 9, STACK_MOST = 16 };
static const uint32_t opaque = UINT32_MAX; /* what asks for no mesh */
static struct shadow_rig rig;
static const double up[3] = {0, 1, 0};
static double points[POINTS][3];
static float found[POINTS][4];

static void prepare(const struct pane_scene *panes)
{
    const struct view_quality quality = {
        .shadows = SHADOWS_MOMENTS, .shadow_resolution = 96, .shadow_taps = 4};
    shadow_rig_prepare_lamps(&rig, panes, &quality);
}

static void ask(uint32_t light, double y, uint32_t object)
{
    for (int i = 0; i < POINTS; i++) {
        points[i][0] = 0.3 * (i % 3) - 0.3;
        points[i][1] = y;
        points[i][2] = 0.3 * (double)(i / 3) - 0.3;
    }
    shadow_rig_query(&rig, light, (const double(*)[3])points, up, POINTS, object, found);
}

static void expect_at(uint32_t light, double y, uint32_t object, const double expected[3],
                      double tolerance)
{
    ask(light, y, object);
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++)
            if (!(fabs((double)found[i][k] - expected[k]) <= tolerance))
                fail_msg("light %u at height %g: channel %d is %.8g instead of %.8g", light, y, k,
                         (double)found[i][k], expected[k]);
}

static bool has_warning(const char *text)
{
    for (int i = 0; i < rig.report.warning_count; i++)
        if (strstr(rig.report.warnings[i], text))
            return true;
    return false;
}

static const double one[3] = {1, 1, 1};
static const float upper[3] = {0.5f, 0.25f, 1}, lower[3] = {0.75f, 0.5f, 0.125f};

/* But for the bias of the moments. One face after the other, and all at once. */
static void one_pane_is_exact(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    const double t[3] = {(double)upper[0], (double)upper[1], (double)upper[2]};
    uint32_t pane = pane_scene_add_sheet(&panes, 2, upper);
    for (int s = 0; s < 2; s++) {
        rig.shadows = rig.systems[s];
        prepare(&panes);
        for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
            expect_at(light, 2.5, opaque, one, 1e-5);
            expect_at(light, 2, pane, one, 1e-3);
            expect_at(light, 1.9, opaque, t, 1e-5);
            expect_at(light, 0, opaque, t, 1e-6);
        }
        assert_false(has_warning("moments"));
    }
    rig.shadows = rig.systems[0];
    pane_scene_finish(&panes);
}

static void two_panes_are_exact_before_on_between_and_behind(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    double first[3], both[3];
    uint32_t nodes[2];
    nodes[1] = pane_scene_add_sheet(&panes, 1, lower);
    nodes[0] = pane_scene_add_sheet(&panes, 2, upper);
    for (int k = 0; k < 3; k++) {
        first[k] = (double)upper[k];
        both[k] = (double)upper[k] * (double)lower[k];
    }
    prepare(&panes);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        expect_at(light, 3, opaque, one, 1e-3);
        expect_at(light, 2, nodes[0], one, 6e-3);
        expect_at(light, 1.5, opaque, first, 3e-3);
        expect_at(light, 1, nodes[1], first, 6e-3);
        expect_at(light, 0.5, opaque, both, 1e-6);
        expect_at(light, 0, opaque, both, 1e-6);
    }
    assert_true(has_warning("shadows moments: light between three and more"));
    pane_scene_finish(&panes);
}

/* A filter of nothing counts as 5e-5, and does not darken what is before it. */
static void a_pane_that_stops_a_colour_does_so(void **state)
{
    (void)state;
    static const float red[3] = {1, 0, 0};
    const double t[3] = {(double)upper[0], (double)upper[1], (double)upper[2]};
    struct pane_scene panes = {0};
    pane_scene_add_sheet(&panes, 2, upper);
    pane_scene_add_sheet(&panes, 1, red);
    prepare(&panes);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        expect_at(light, 1.5, opaque, t, 2e-3);
        expect_at(light, 0, opaque, (const double[3]){t[0], 0, 0}, 5e-5);
    }
    pane_scene_finish(&panes);
}

/* In the same memory. */
static void what_is_behind_all_of_many_is_exact(void **state)
{
    (void)state;
    enum { PANES = 40 };
    struct pane_scene panes = {0};
    double product[3] = {1, 1, 1};
    uint64_t seed = 7, texels = 0;
    for (int i = 0; i < PANES; i++) {
        float color[3];
        for (int k = 0; k < 3; k++) {
            color[k] = 0.9f + 0.1f * (float)rig_random(&seed);
            product[k] *= (double)color[k];
        }
        pane_scene_add_sheet(&panes, 1 + 0.05 * (i * 13 % PANES), color);
        if (i && i < PANES - 1)
            continue;
        prepare(&panes);
        for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
            expect_at(light, 0.9, opaque, product, 2e-6);
            expect_at(light, 0, opaque, product, 2e-6);
        }
        texels = texels ? texels : shadow_system_map(rig.shadows, 0)->texels.count;
        assert_true(shadow_system_map(rig.shadows, 0)->texels.count == texels);
    }
    pane_scene_finish(&panes);
}

/* ---- double precision ---- */

struct stack {
    int count;
    double heights[STACK_MOST]; /* from the light on */
    double absorbance[STACK_MOST][3];
    uint32_t nodes[STACK_MOST];
};

static void make_stack(struct stack *stack, struct pane_scene *panes, int count, uint64_t *seed)
{
    stack->count = count;
    for (int i = 0; i < count; i++) {
        float color[3];
        for (int k = 0; k < 3; k++) {
            color[k] = 0.1f + 0.85f * (float)rig_random(seed);
            stack->absorbance[i][k] = -log((double)color[k]);
        }
        stack->heights[i] = 4 - 3.6 * (i + 0.1 + 0.8 * rig_random(seed)) / count;
        stack->nodes[i] = pane_scene_add_sheet(panes, stack->heights[i], color);
    }
}

static double exact_at(const struct stack *stack, double y, int channel)
{
    double sum = 0;
    for (int i = 0; i < stack->count; i++)
        sum += stack->heights[i] > y + 1e-9 ? stack->absorbance[i][channel] : 0;
    return exp(-sum);
}

/* Of the distribution over z and two more depths, the masses in front of z and at it: weights w and
 * 1 - w - at of the roots of the polynomial that is orthogonal to 1 and x under (x - z). */
static void masses_at(const double m[5], double z, double *front, double *at)
{
    double a0 = m[2] - z * m[1], a1 = m[1] - z, a2 = m[3] - z * m[2];
    double b0 = m[3] - z * m[2], b1 = m[2] - z * m[1], b2 = m[4] - z * m[3];
    double d = a0 * b1 - a1 * b0, u = (a1 * b2 - b1 * a2) / d, v = (b0 * a2 - a0 * b2) / d;
    double root = sqrt(fmax(u * u / 4 - v, 0)), near = -u / 2 - root, far = -u / 2 + root;
    double of_near = (m[2] - (z + far) * m[1] + z * far) / ((near - z) * (near - far));
    double of_far = (m[2] - (z + near) * m[1] + z * near) / ((far - z) * (far - near));
    *at = 1 - of_near - of_far;
    *front = (near < z ? of_near : 0) + (far < z ? of_far : 0);
}

/* The sun's light at the middle of the points; depths run along it. */
static double modelled_at(const struct stack *stack, double y, bool is_caster, int channel)
{
    static const double biased[5] = {1, 0, 0.375, 0, 0.375}, bias = 5e-7;
    const struct shadow_map *map = shadow_system_map(rig.shadows, 0);
    double steepness = fabs(map->frame.axis[2][1]), m[5] = {0}, front, at;
    double here = shadow_texels_depth(&map->frame, (const double[3]){0, y, 0});
    double z = (here - map->nearest_m) * map->depths_per_m - 1 - (is_caster ? 0.02 : 0);
    for (int i = 0; i < stack->count; i++) {
        double depth = here - (stack->heights[i] - y) / steepness;
        for (int k = 0; k < 5; k++)
            m[k] += stack->absorbance[i][channel] *
                    pow((depth - map->nearest_m) * map->depths_per_m - 1, k);
    }
    double all = m[0];
    for (int k = 0; k < 5; k++)
        m[k] = m[k] / all * (1 - bias) + biased[k] * bias;
    masses_at(m, z, &front, &at);
    return exp(-all * (front + (is_caster ? 0.25 : 0.4) * at));
}

struct off {
    double sum, most, off_model;
    int count;
};

static void add_at(struct off *off, const struct stack *stack, double y, uint32_t object)
{
    ask(0, y, object);
    for (int k = 0; k < 3; k++) {
        double is = (double)found[4][k], error = fabs(is - exact_at(stack, y, k));
        off->sum += error;
        off->most = fmax(off->most, error);
        off->off_model =
            fmax(off->off_model, fabs(is - modelled_at(stack, y, object != opaque, k)));
        off->count++;
    }
}

/* By how many panes there are: a mean and a worst that half of each other's size would exceed. */
static void more_panes_are_near_the_exact_light(void **state)
{
    (void)state;
    static const int counts[] = {3, 5, 8, 16};
    uint64_t seed = 11;
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        struct off between = {0}, on = {0};
        for (int round = 0; round < 10; round++) {
            struct pane_scene panes = {0};
            struct stack stack;
            make_stack(&stack, &panes, counts[c], &seed);
            prepare(&panes);
            for (int i = 0; i < counts[c]; i++) {
                add_at(&on, &stack, stack.heights[i], stack.nodes[i]);
                if (i)
                    add_at(&between, &stack, (stack.heights[i - 1] + stack.heights[i]) / 2, opaque);
            }
            pane_scene_finish(&panes);
        }
        print_message("%d panes: between them %.4f, at most %.3f; on them %.4f, at most %.3f; off "
                      "double precision by %.2g\n",
                      counts[c], between.sum / between.count, between.most, on.sum / on.count,
                      on.most, fmax(between.off_model, on.off_model));
        assert_true(between.sum / between.count < 0.08 && between.most < 0.6);
        assert_true(on.sum / on.count < 0.11 && on.most < 0.6);
        assert_true(between.off_model < 0.02 && on.off_model < 0.02);
    }
}

static void maps_have_the_same_bits_every_time(void **state)
{
    (void)state;
    static float before[POINTS][4];
    struct pane_scene panes = {0};
    uint64_t seed = 5;
    struct stack stack;
    make_stack(&stack, &panes, 6, &seed);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
        for (int round = 0; round < 3; round++) {
            rig.shadows = rig.systems[round % 2];
            shadow_system_forget(rig.shadows, "panes");
            prepare(&panes);
            ask(light, 2, opaque);
            assert_true(!round || !memcmp(found, before, sizeof found));
            memcpy(before, found, sizeof found);
        }
    rig.shadows = rig.systems[0];
    pane_scene_finish(&panes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_pane_is_exact),
        cmocka_unit_test(two_panes_are_exact_before_on_between_and_behind),
        cmocka_unit_test(a_pane_that_stops_a_colour_does_so),
        cmocka_unit_test(what_is_behind_all_of_many_is_exact),
        cmocka_unit_test(more_panes_are_near_the_exact_light),
        cmocka_unit_test(maps_have_the_same_bits_every_time),
    };
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}

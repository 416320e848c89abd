/* SPDX-License-Identifier: MIT */
/* Moment-based transparency: one and two layers are exact within the bias of the moments, and any
 * number of one light; three and more are what double precision makes of their moments, and near
 * the exact picture; as published a layer dims itself. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"
#include "tests/support/pane_stack.h"

enum { SIDE_PX = 8, MANY_PANES = 64, STACKS = 24, STACK_MOST = 9 };

static void seen_of(struct renderer *renderer, const struct pane *panes, int count,
                    const struct pane_shot *as, double seen[3])
{
    struct frame frame;
    struct pane_shot shot = *as;
    shot.transparency = TRANSPARENCY_MOMENT_BASED;
    shot.side_px = SIDE_PX;
    shot.samples = shot.samples ? shot.samples : 1;
    pane_stack_render(renderer, panes, count, &shot, &frame);
    assert_true(report_has_warning(&frame.report, "transparency moment-based tells from four"));
    for (int c = 0; c < 3; c++)
        seen[c] = (double)image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], 4, 4)[c];
    frame_finish(&frame);
}

static void check_exact(struct renderer *renderer, const struct pane *panes, int count,
                        double tolerance)
{
    for (int is_perspective = 0; is_perspective < 2; is_perspective++) {
        double seen[3];
        seen_of(renderer, panes, count, &(struct pane_shot){.is_perspective = is_perspective},
                seen);
        for (int c = 0; c < 3; c++)
            if (!(fabs(seen[c] - pane_stack_exact(panes, count, c)) < tolerance))
                fail_msg("channel %d: %g, exact %g", c, seen[c], pane_stack_exact(panes, count, c));
    }
}

static void one_layer_and_two_are_exact(void **state)
{
    static const double alphas[] = {0.01, 0.3, 0.9, 0.999};
    for (int i = 0; i < 16; i++) {
        const struct pane panes[] = {
            {.z = 3, .color = {1, 0.25, 0.125}, .alpha = alphas[i % 4]},
            {.z = -6, .color = {0.25, 0.125, 1}, .alpha = alphas[i / 4]},
        };
        check_exact(*state, panes, 1, 1e-4);
        check_exact(*state, panes, 2, 2e-3);
    }
}

/* Channels have moments of their own. */
static void filters_may_have_a_color(void **state)
{
    const struct pane panes[] = {
        {.z = 1, .color = {0.75, 0.5, 0.25}, .is_clear = true},
        {.z = -1, .color = {0.125, 0.25, 0.375}, .alpha = 0.6},
    };
    check_exact(*state, panes, 2, 2e-3);
}

static void layers_of_one_light_are_exact(void **state)
{
    struct pane panes[MANY_PANES];
    for (int i = 0; i < MANY_PANES; i++)
        panes[i] = (struct pane){.z = i * 37 % MANY_PANES * 0.1,
                                 .color = {0.5, 0.25, 0.125},
                                 .alpha = i % 2 ? 1 / 64.0 : 1 / 16.0};
    check_exact(*state, panes, MANY_PANES, 1e-4);
}

/* ---- double precision ---- */

struct reconstruction {
    double sum, moments[5]; /* of mass 1 */
    bool faithful;
};

static double determinant(double m[3][3])
{
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/* Three depths, z among them, have these moments: the two others are the roots of the polynomial
 * whose product with 1 / (x - z) is orthogonal to 1 and x; masses by Cramer's rule. */
static void masses_at(const double m[5], double z, double *front, double *at)
{
    /* p(x) = x^2 + u x + v with sum over the masses of (x - z) p(x) and (x - z) p(x) x equal 0 */
    double a0 = m[2] - z * m[1], a1 = m[1] - z, a2 = m[3] - z * m[2];
    double b0 = m[3] - z * m[2], b1 = m[2] - z * m[1], b2 = m[4] - z * m[3];
    double d = a0 * b1 - a1 * b0, u = (a1 * b2 - b1 * a2) / d, v = (b0 * a2 - a0 * b2) / d;
    double root = sqrt(fmax(u * u / 4 - v, 0)), x[3] = {z, -u / 2 - root, -u / 2 + root}, mass[3];
    double powers[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            powers[k][i] = pow(x[i], k);
    double all = determinant(powers);
    for (int i = 0; i < 3; i++) {
        double with[3][3];
        memcpy(with, powers, sizeof with);
        for (int k = 0; k < 3; k++)
            with[k][i] = m[k];
        mass[i] = determinant(with) / all;
    }
    *at = mass[0];
    *front = (x[1] < z ? mass[1] : 0) + (x[2] < z ? mass[2] : 0);
}

static double visible_at(const struct reconstruction *r, double z, double tau)
{
    double front, at;
    masses_at(r->moments, z, &front, &at);
    if (r->faithful)
        return exp(-r->sum * (front + 0.25 * at));
    return exp(-r->sum * front - 0.5 * fmax(r->sum * at - tau, 0));
}

/* Panes from the nearest to the farthest, seen by an orthographic camera. */
static double expected(const struct pane *panes, int count, int channel, bool faithful)
{
    static const double biased[5] = {1, 0, 0.375, 0, 0.375}, bias = 5e-7;
    struct reconstruction r = {.faithful = faithful};
    double middle = (panes[0].z + panes[count - 1].z) / 2, half = panes[0].z - middle;
    double light = 0, reached = 0, through = 1;
    for (int i = 0; i < count; i++) {
        double tau = -log(pane_filter(&panes[i], channel));
        double z = half > 0 ? (middle - panes[i].z) / half : -1;
        for (int k = 0; k < 5; k++)
            r.moments[k] += tau * pow(z, k);
        through *= pane_filter(&panes[i], channel);
    }
    r.sum = r.moments[0];
    for (int k = 0; k < 5; k++)
        r.moments[k] = r.moments[k] / r.sum * (1 - bias) + biased[k] * bias;
    for (int i = 0; i < count; i++) {
        double z = half > 0 ? (middle - panes[i].z) / half : -1;
        double seen = visible_at(&r, z, -log(pane_filter(&panes[i], channel)));
        light += seen * pane_light(&panes[i], channel);
        reached += seen * (1 - pane_filter(&panes[i], channel));
    }
    return light / reached * (1 - through) + through;
}

static double random_unit(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) / (1 << 24);
}

static int random_stack(uint32_t *seed, struct pane panes[STACK_MOST])
{
    int count = 3 + (int)(random_unit(seed) * (STACK_MOST - 2));
    double z = 6;
    for (int i = 0; i < count; i++) {
        panes[i] = (struct pane){.z = z, .alpha = 0.1 + 0.7 * random_unit(seed)};
        for (int c = 0; c < 3; c++)
            panes[i].color[c] = random_unit(seed);
        z -= 0.2 + 2 * random_unit(seed);
    }
    return count;
}

static void many_layers_are_what_their_moments_say(void **state)
{
    uint32_t seed = 3;
    double error = 0, largest = 0;
    for (int i = 0; i < STACKS; i++) {
        struct pane panes[STACK_MOST];
        int count = random_stack(&seed, panes);
        for (int faithful = 0; faithful < 2; faithful++) {
            double seen[3];
            seen_of(*state, panes, count, &(struct pane_shot){.faithful = faithful}, seen);
            for (int c = 0; c < 3; c++) {
                double told = expected(panes, count, c, faithful);
                double off = fabs(seen[c] - pane_stack_exact(panes, count, c));
                if (!(fabs(seen[c] - told) < 3e-3))
                    fail_msg("%d panes, channel %d: %g, by its moments %g", count, c, seen[c],
                             told);
                error += faithful ? 0 : off / (3 * STACKS);
                largest = faithful ? largest : fmax(largest, off);
            }
        }
    }
    print_message("mean error %g, largest %g\n", error, largest);
    assert_true(error < 0.02 && largest < 0.1);
}

static void as_published_a_layer_dims_itself(void **state)
{
    const struct pane panes[] = {
        {.z = 3, .color = {1, 0.25, 0.125}, .alpha = 0.3},
        {.z = -6, .color = {0.25, 0.125, 1}, .alpha = 0.6},
    };
    double seen[3], near = pow(0.7, 0.25), far = 0.7 * pow(0.4, 0.25);
    seen_of(*state, panes, 2, &(struct pane_shot){.faithful = true}, seen);
    for (int c = 0; c < 3; c++) {
        double light = near * pane_light(&panes[0], c) + far * pane_light(&panes[1], c);
        double told = light / (near * 0.3 + far * 0.6) * (1 - 0.7 * 0.4) + 0.7 * 0.4;
        assert_true(fabs(seen[c] - told) < 2e-3);
        assert_true(c == 1 || fabs(told - pane_stack_exact(panes, 2, c)) > 0.01);
    }
}

/* Coplanar panes are in no order: each is seen alike. */
static void coplanar_layers_are_a_mean(void **state)
{
    const struct pane panes[] = {
        {.z = 0, .color = {1, 0.25, 0.125}, .alpha = 0.5},
        {.z = 0, .color = {0.25, 0.125, 1}, .alpha = 0.5},
    };
    double seen[3];
    seen_of(*state, panes, 2, &(struct pane_shot){0}, seen);
    for (int c = 0; c < 3; c++) {
        double mean = (panes[0].color[c] + panes[1].color[c]) / 2;
        assert_true(fabs(seen[c] - (0.75 * mean + 0.25)) < 1e-4);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_layer_and_two_are_exact),
        cmocka_unit_test(filters_may_have_a_color),
        cmocka_unit_test(layers_of_one_light_are_exact),
        cmocka_unit_test(many_layers_are_what_their_moments_say),
        cmocka_unit_test(as_published_a_layer_dims_itself),
        cmocka_unit_test(coplanar_layers_are_a_mean),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Moment-based transparency: one to four layers are exact within the bias of the moments, and any
 * number of one light; more are what double precision makes of their moments, and near the exact
 * picture; as published, with four moments, a layer dims itself. */
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
    assert_true(report_has_warning(&frame.report, "transparency moment-based tells from moments"));
    for (int c = 0; c < 3; c++)
        seen[c] = (double)image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], 4, 4)[c];
    frame_finish(&frame);
}

static double random_unit(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) / (1 << 24);
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

static void three_layers_and_four_are_exact(void **state)
{
    uint32_t seed = 9;
    for (int i = 0; i < 12; i++) {
        struct pane panes[4];
        for (int p = 0; p < 4; p++)
            panes[p] = (struct pane){.z = 4 - 2.5 * p + 0.8 * random_unit(&seed),
                                     .color = {random_unit(&seed), random_unit(&seed), 0.5},
                                     .alpha = 0.1 + 0.8 * random_unit(&seed)};
        check_exact(*state, panes, 3, 5e-3);
        check_exact(*state, panes, 4, 5e-3);
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
    double sum, moments[7]; /* of mass 1 */
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

/* Likewise with six moments: a cubic polynomial that is orthogonal to 1, x and x^2. */
static void six_masses_at(const double m[7], double z, double *front, double *at)
{
    double rows[3][3], right[3], u[3];
    for (int j = 0; j < 3; j++) {
        for (int k = 0; k < 3; k++)
            rows[j][k] = m[j + k + 1] - z * m[j + k];
        right[j] = z * m[j + 3] - m[j + 4];
    }
    for (int k = 0; k < 3; k++) {
        double with[3][3];
        memcpy(with, rows, sizeof with);
        for (int j = 0; j < 3; j++)
            with[j][k] = right[j];
        u[k] = determinant(with) / determinant(rows);
    }
    /* the roots of x^3 + u2 x^2 + u1 x + u0 */
    double a = u[2] / 3, s = sqrt(fmax(a * a - u[1] / 3, 0));
    double q = 2 * a * a * a - a * u[1] + u[0];
    double angle = acos(fmin(fmax(-q / (2 * s * s * s), -1), 1)) / 3, x[4] = {z};
    for (int k = 0; k < 3; k++)
        x[k + 1] = 2 * s * cos(angle + k * 2 * acos(-1) / 3) - a;
    *front = 0;
    for (int i = 0; i < 4; i++) {
        double p[4] = {1}, scale = 1; /* the product of all other x - x[j], from the constant on */
        for (int j = 0, degree = 0; j < 4; j++) {
            if (j == i)
                continue;
            for (int k = ++degree; k >= 0; k--)
                p[k] = (k ? p[k - 1] : 0) - x[j] * (k < degree ? p[k] : 0);
            scale *= x[i] - x[j];
        }
        double mass = (p[0] + p[1] * m[1] + p[2] * m[2] + p[3] * m[3]) / scale;
        if (!i)
            *at = mass;
        else
            *front += x[i] < z ? mass : 0;
    }
}

static double visible_at(const struct reconstruction *r, double z, double tau)
{
    double front, at;
    (r->faithful ? masses_at : six_masses_at)(r->moments, z, &front, &at);
    if (r->faithful)
        return exp(-r->sum * (front + 0.25 * at));
    return exp(-r->sum * front - 0.5 * fmax(r->sum * at - tau, 0));
}

/* Panes from the nearest to the farthest, seen by an orthographic camera. */
static double expected(const struct pane *panes, int count, int channel, bool faithful)
{
    static const double of_four[7] = {1, 0, 0.375, 0, 0.375},
                        of_six[7] = {1, 0, 0.48, 0, 0.451, 0, 0.45};
    const double *biased = faithful ? of_four : of_six, bias = faithful ? 5e-7 : 5e-6;
    struct reconstruction r = {.faithful = faithful};
    double middle = (panes[0].z + panes[count - 1].z) / 2, half = panes[0].z - middle;
    double light = 0, reached = 0, through = 1;
    for (int i = 0; i < count; i++) {
        double tau = -log(pane_filter(&panes[i], channel));
        double z = half > 0 ? (middle - panes[i].z) / half : -1;
        for (int k = 0; k < 7; k++)
            r.moments[k] += tau * pow(z, k);
        through *= pane_filter(&panes[i], channel);
    }
    r.sum = r.moments[0];
    for (int k = 0; k < 7; k++)
        r.moments[k] = r.moments[k] / r.sum * (1 - bias) + biased[k] * bias;
    for (int i = 0; i < count; i++) {
        double z = half > 0 ? (middle - panes[i].z) / half : -1;
        double seen = visible_at(&r, z, -log(pane_filter(&panes[i], channel)));
        light += seen * pane_light(&panes[i], channel);
        reached += seen * (1 - pane_filter(&panes[i], channel));
    }
    return light / reached * (1 - through) + through;
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
    double error[2] = {0}, largest[2] = {0}; /* of six moments, and of four */
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
                error[faithful] += off / (3 * STACKS);
                largest[faithful] = fmax(largest[faithful], off);
            }
        }
    }
    print_message("mean error %g, largest %g; as published %g, %g\n", error[0], largest[0],
                  error[1], largest[1]);
    assert_true(error[0] < 0.01 && largest[0] < 0.1);
    assert_true(error[0] < 0.5 * error[1] && error[1] < 0.05);
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
        cmocka_unit_test(three_layers_and_four_are_exact),
        cmocka_unit_test(filters_may_have_a_color),
        cmocka_unit_test(layers_of_one_light_are_exact),
        cmocka_unit_test(many_layers_are_what_their_moments_say),
        cmocka_unit_test(as_published_a_layer_dims_itself),
        cmocka_unit_test(coplanar_layers_are_a_mean),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

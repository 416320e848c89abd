/* SPDX-License-Identifier: MIT */
/* Optical depth of haze against fine sums, at its extremes, and the phase function over the sphere.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "renderer/scene/atmosphere.h"

static double sum(const struct view_atmosphere *air, double height, double climb, double length)
{
    enum { STEPS = 400000 };
    double total = 0;
    for (int i = 0; i < STEPS; i++)
        total += atmosphere_extinction(air, height + climb * length * (i + 0.5) / STEPS);
    return total * length / STEPS;
}

static void depths_are_those_of_fine_sums(void **state)
{
    (void)state;
    static const double heights[] = {-3, -0.2, 0.5, 0.7, 4}, climbs[] = {-1, -0.3, 0, 1e-9, 0.4, 1},
                        lengths[] = {1e-3, 1, 9}, falloffs[] = {0, 0.3, 5, 1e9};
    for (size_t i = 0; i < 5; i++)
        for (size_t j = 0; j < 6; j++)
            for (size_t k = 0; k < 3; k++)
                for (size_t l = 0; l < 4; l++) {
                    const struct view_atmosphere air = {
                        .density_per_m = 0.7, .falloff_m = falloffs[l], .base_m = 0.5};
                    double expected = sum(&air, heights[i], climbs[j], lengths[k]);
                    double found = atmosphere_depth(&air, heights[i], climbs[j], lengths[k]);
                    if (fabs(found - expected) > 2e-6 * expected + 1e-12)
                        fail_msg("height %g, climb %g, length %g, falloff %g: %.9g, not %.9g",
                                 heights[i], climbs[j], lengths[k], falloffs[l], found, expected);
                }
}

static void endless_ways_have_their_limits(void **state)
{
    (void)state;
    struct view_atmosphere air = {.density_per_m = 2, .falloff_m = 3, .base_m = 1};
    assert_true(fabs(atmosphere_depth(&air, 1, 0.5, INFINITY) - 2 * 3 / 0.5) < 1e-12);
    assert_true(fabs(atmosphere_depth(&air, 0, 1, INFINITY) - 2 * (1 + 3)) < 1e-12);
    assert_true(isinf(atmosphere_depth(&air, 5, -0.1, INFINITY)));
    assert_true(isinf(atmosphere_depth(&air, 5, 0, INFINITY)));
    assert_true(atmosphere_depth(&air, 1e6, 0.1, INFINITY) == 0);
    assert_true(isinf(atmosphere_depth(&air, -1e6, -1, INFINITY)));
    air.falloff_m = 1e-6;
    assert_true(fabs(atmosphere_depth(&air, 3, -1, 4) - 2 * 2) < 1e-5);
    assert_true(atmosphere_depth(&air, 1e6, -1, 1) == 0);
    air.falloff_m = 0;
    assert_true(isinf(atmosphere_depth(&air, 0, 0.1, INFINITY)));
    assert_true(atmosphere_depth(&air, 0, 0.1, 0) == 0);
    air.density_per_m = 0;
    assert_true(atmosphere_depth(&air, 0, 0.1, INFINITY) == 0);
}

static void the_phase_function_scatters_all(void **state)
{
    (void)state;
    enum { STEPS = 200000 };
    static const double means[] = {-0.95, -0.3, 0, 0.6, 0.95};
    for (size_t i = 0; i < 5; i++) {
        const struct view_atmosphere air = {.anisotropy = means[i]};
        double all = 0, mean = 0;
        for (int k = 0; k < STEPS; k++) {
            double cosine = 2 * (k + 0.5) / STEPS - 1;
            double share = atmosphere_phase(&air, cosine) * 4 * M_PI / STEPS;
            all += share;
            mean += share * cosine;
        }
        assert_true(fabs(all - 1) < 1e-4 && fabs(mean - means[i]) < 1e-4);
    }
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(depths_are_those_of_fine_sums),
        cmocka_unit_test(endless_ways_have_their_limits),
        cmocka_unit_test(the_phase_function_scatters_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

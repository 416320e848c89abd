/* SPDX-License-Identifier: MIT */
/* Polygons cut by planes: what is left, and how many corners it has at the most. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/polygon_clip.h"

static double random_in(uint64_t *seed, double low, double high)
{
    *seed = *seed * 6364136223846793005ull + 1442695040888963407ull;
    return low + (high - low) * (double)(*seed >> 11) / 9007199254740992.0;
}

static double area(double (*corners)[3], int count)
{
    double sum[3] = {0};
    for (int i = 2; i < count; i++) {
        double a[3], b[3], across[3];
        vec3_sub(corners[i - 1], corners[0], a);
        vec3_sub(corners[i], corners[0], b);
        vec3_cross(a, b, across);
        for (int k = 0; k < 3; k++)
            sum[k] += 0.5 * across[k];
    }
    return vec3_length(sum);
}

static void two_sides_of_a_plane_make_the_whole(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 1000; i++) {
        double whole[3][3], sides[2][POLYGON_CORNERS_MAX][3], plane[4];
        for (int k = 0; k < 9; k++)
            whole[k / 3][k % 3] = random_in(&seed, -1, 1);
        for (int k = 0; k < 4; k++)
            plane[k] = random_in(&seed, -1, 1);
        double other[4] = {-plane[0], -plane[1], -plane[2], -plane[3]}, sum = 0;
        for (int side = 0; side < 2; side++) {
            memcpy(sides[side], whole, sizeof whole);
            int count = polygon_clip(side ? other : plane, sides[side], 3);
            assert_true(count == 0 || count == 3 || count == 4);
            sum += area(sides[side], count);
        }
        assert_true(fabs(sum - area(whole, 3)) < 1e-12);
    }
}

/* On the planes themselves heights are rounding, with signs of any order. */
static void a_plane_adds_one_corner_at_the_most(void **state)
{
    (void)state;
    uint64_t seed = 2;
    int most = 0;
    for (int i = 0; i < 30000; i++) {
        double u[3], v[3], plane[4], corners[POLYGON_CORNERS_MAX][3];
        for (int k = 0; k < 3; k++) {
            u[k] = random_in(&seed, -1, 1);
            v[k] = random_in(&seed, -1, 1);
        }
        vec3_cross(u, v, plane);
        plane[3] = -vec3_dot(plane, (const double[3]){0.3, -0.7, 0.2});
        for (int c = 0; c < 3; c++) {
            double s = random_in(&seed, -1, 1), t = random_in(&seed, -1, 1);
            for (int k = 0; k < 3; k++)
                corners[c][k] = ((const double[3]){0.3, -0.7, 0.2})[k] + s * u[k] + t * v[k];
        }
        int count = 3;
        for (int p = 0; p < POLYGON_PLANES_MAX && count; p++) {
            double length = random_in(&seed, -9, 9);
            double scaled[4] = {length * plane[0], length * plane[1], length * plane[2],
                                length * plane[3]};
            int before = count;
            count = polygon_clip(scaled, corners, count);
            assert_int_in_range(count, 0, before + 1);
            most = count > most ? count : most;
        }
    }
    assert_true(most > 4); /* the case is met */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_sides_of_a_plane_make_the_whole),
        cmocka_unit_test(a_plane_adds_one_corner_at_the_most),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* Where samples lie: within their pixels, about their centres, all apart, and so that half planes
 * are covered by less error the more samples there are. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "renderer/base/sample_pattern.h"
#include "tests/support/half_plane.h"

static const int counts[] = {1, 4, 8, 16};
enum { COUNTS = sizeof counts / sizeof counts[0], LINES = 20000 };

static void samples_lie_apart_in_their_pixel_and_about_its_centre(void **unused)
{
    (void)unused;
    for (int i = 0; i < COUNTS; i++) {
        double place[16][2], mean[2] = {0, 0};
        for (int s = 0; s < counts[i]; s++) {
            sample_pattern_place(counts[i], s, place[s]);
            for (int k = 0; k < 2; k++) {
                assert_true(place[s][k] >= 0 && place[s][k] <= 1);
                mean[k] += place[s][k] / counts[i];
            }
            for (int t = 0; t < s; t++) /* also of the next pixel's */
                for (int dx = -1; dx <= 1; dx++)
                    for (int dy = -1; dy <= 1; dy++)
                        assert_true(hypot(place[s][0] - place[t][0] + dx,
                                          place[s][1] - place[t][1] + dy) > 0.08);
        }
        assert_true(fabs(mean[0] - 0.5) < 1e-12 && fabs(mean[1] - 0.5) < 1e-12);
    }
}

static void rounds_of_one_sample_and_of_four_show_the_same_places(void **unused)
{
    (void)unused;
    for (int i = 1; i < COUNTS; i++)
        for (int s = 0; s < counts[i]; s++) {
            double place[2], standard[2], one[2], four[2];
            int rounds = counts[i] / SAMPLES_PER_ROUND;
            sample_pattern_place(counts[i], s, place);
            sample_pattern_place(4, s % 4, standard);
            sample_pattern_shift(1, counts[i], s, one);
            sample_pattern_shift(4, rounds, s / 4, four);
            for (int k = 0; k < 2; k++) {
                assert_true(fabs(0.5 - one[k] - place[k]) < 1e-12);
                assert_true(fabs(standard[k] - four[k] - place[k]) < 1e-12);
                assert_true(fabs(one[k]) <= sample_pattern_reach(1, counts[i]));
                assert_true(fabs(four[k]) <= sample_pattern_reach(4, rounds));
            }
        }
    assert_true(sample_pattern_reach(4, 1) == 0);
}

/* Over half planes in directions within `spread` of the axes. */
static double rms_of(int samples, double spread)
{
    double sum = 0;
    for (int i = 0; i < LINES; i++) { /* Roberts 2018, R2 */
        double u = fmod(0.5 + 0.7548776662466927 * i, 1), v = fmod(0.5 + 0.5698402909980532 * i, 1);
        double angle = spread * (2 * u - 1) + i % 4 * 1.5707963267948966, covered = 0;
        struct half_plane plane = {.normal = {cos(angle), sin(angle)}};
        plane.offset = (2 * v - 1) * 0.5 * (fabs(plane.normal[0]) + fabs(plane.normal[1]));
        for (int s = 0; s < samples; s++) {
            double place[2];
            sample_pattern_place(samples, s, place);
            covered += half_plane_has(&plane, place[0] - 0.5, place[1] - 0.5);
        }
        double off = covered / samples - half_plane_share(&plane, 0, 0);
        sum += off * off;
    }
    return sqrt(sum / LINES);
}

static void half_planes_are_covered_by_less_error_with_more_samples(void **unused)
{
    (void)unused;
    static const double most[COUNTS][2] = {
        {0.26, 0.30}, {0.094, 0.075}, {0.069, 0.040}, {0.050, 0.028}};
    for (int i = 0; i < COUNTS; i++) {
        double all = rms_of(counts[i], 0.7853981633974483), level = rms_of(counts[i], 0.1);
        print_message("%d samples: RMS of coverage %.4f in all directions, %.4f near the axes\n",
                      counts[i], all, level);
        assert_true(all < most[i][0] && level < most[i][1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_lie_apart_in_their_pixel_and_about_its_centre),
        cmocka_unit_test(rounds_of_one_sample_and_of_four_show_the_same_places),
        cmocka_unit_test(half_planes_are_covered_by_less_error_with_more_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

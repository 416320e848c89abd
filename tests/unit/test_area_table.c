/* SPDX-License-Identifier: MIT */
/* Tables of half planes on a light: what an entry has, what the next one to a line has, and how far
 * neighbours differ (Wang et al. 2014, before table 4). */
#include "renderer/shadows/area_table.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_job.h"
#include "tests/support/light_scene.h"

static void find_places(bool is_disk, uint32_t points, double (*places)[2])
{
    const struct state_light unit = {.type = is_disk ? SCENE_LIGHT_DISK : SCENE_LIGHT_RECT,
                                     .half_u = {1, 0, 0},
                                     .half_v = {0, 1, 0}};
    for (uint32_t i = 0; i < points; i++) {
        double square[2], at[3];
        rt_sequence_point(i, rt_job_seed(0, 0, 0), square);
        rt_light_place(&unit, square, at);
        memcpy(places[i], at, sizeof places[i]);
    }
}

/* Where the table has the half plane a x + b y + c >= 0, or that next to it, as area_mask.comp.glsl
 * has it: index of its first word. */
static uint64_t entry_of(uint32_t points, const double line[3])
{
    const double length = hypot(line[0], line[1]);
    const double turn = atan2(line[1], line[0]) / (2 * M_PI) + 1;
    const double along = length > 0 ? -line[2] / length : line[2] >= 0 ? -9 : 9;
    const double share = fmin(fmax(0.5 + 0.5 * along / AREA_TABLE_REACH, 0), 1);
    const uint64_t row = (uint64_t)lround(turn * AREA_TABLE_SIDE) % AREA_TABLE_SIDE;
    const uint64_t column = (uint64_t)lround(share * (AREA_TABLE_SIDE - 1));
    return (row * AREA_TABLE_SIDE + column) * area_table_vectors(points) * 4;
}

static uint32_t *make(bool is_disk, uint32_t points)
{
    uint32_t *masks = malloc(area_table_words(points) * sizeof *masks);
    assert_non_null(masks);
    area_table_fill(is_disk, points, masks);
    return masks;
}

static int bits_of(const uint32_t *mask, uint32_t words)
{
    int bits = 0;
    for (uint32_t i = 0; i < words; i++)
        bits += __builtin_popcount(mask[i]);
    return bits;
}

static int bits_that_differ(const uint32_t *a, const uint32_t *b, uint32_t words)
{
    int bits = 0;
    for (uint32_t i = 0; i < words; i++)
        bits += __builtin_popcount(a[i] ^ b[i]);
    return bits;
}

static double height_over(const double line[3], const double place[2])
{
    return line[0] * place[0] + line[1] * place[1] + line[2];
}

/* Each entry's own line, and any line: points that are farther from it than half a step of both
 * coordinates are on their side. */
static void check_lines(bool is_disk, uint32_t points)
{
    double places[AREA_TABLE_POINTS_MAX][2];
    uint32_t *masks = make(is_disk, points);
    uint64_t seed = 3;
    find_places(is_disk, points, places);
    for (int i = 0; i < 4000; i++) {
        const bool is_own = i % 2;
        double angle =
            is_own ? 2 * M_PI * (i / 4) / AREA_TABLE_SIDE : random_uniform(&seed, -M_PI, M_PI);
        double along = is_own ? AREA_TABLE_REACH * (2.0 * (i % 1024) / (AREA_TABLE_SIDE - 1) - 1)
                              : random_uniform(&seed, -1.6, 1.6);
        double size = exp2(random_uniform(&seed, -9, 9));
        const double line[3] = {size * cos(angle), size * sin(angle), -size * along};
        double step = AREA_TABLE_REACH / (AREA_TABLE_SIDE - 1) +
                      AREA_TABLE_REACH * M_PI / AREA_TABLE_SIDE + 1e-9;
        const uint32_t *mask = masks + entry_of(points, line);
        for (uint32_t p = 0; p < points; p++) {
            double height = height_over(line, places[p]) / size;
            if (fabs(height) > (is_own ? 1e-9 : step))
                assert_int_equal(mask[p / 32] >> p % 32 & 1, height > 0);
        }
    }
    free(masks);
}

static void lines_have_the_points_on_their_side(void **unused)
{
    (void)unused;
    check_lines(false, 256);
    check_lines(true, 256);
    check_lines(false, 5);
    check_lines(true, 130);
}

static void lines_that_miss_the_light_have_all_points_or_none(void **unused)
{
    (void)unused;
    uint32_t *masks = make(false, 100);
    const double lines[4][3] = {{1, 0, 9}, {0, -1, -9}, {0, 0, 2}, {0, 0, -2}};
    for (int i = 0; i < 4; i++)
        assert_int_equal(bits_of(masks + entry_of(100, lines[i]), 4), i % 2 ? 0 : 100);
    free(masks);
    assert_int_equal(area_table_vectors(128), 1);
    assert_int_equal(area_table_vectors(256), 2);
    assert_int_equal(area_table_vectors(257), 0);
}

struct difference {
    int most;
    double mean;
};

/* Of neighbouring entries. */
static struct difference differences(bool is_disk)
{
    enum { POINTS = 256, WORDS = 8, SIDE = AREA_TABLE_SIDE };
    uint32_t *masks = make(is_disk, POINTS);
    struct difference found = {0, 0};
    for (int row = 0; row < SIDE; row++)
        for (int column = 0; column < SIDE; column++) {
            const uint32_t *here = masks + ((size_t)row * SIDE + (size_t)column) * WORDS;
            const uint32_t *below =
                masks + ((size_t)((row + 1) % SIDE) * SIDE + (size_t)column) * WORDS;
            int turned = bits_that_differ(here, below, WORDS);
            int moved = column + 1 < SIDE ? bits_that_differ(here, here + WORDS, WORDS) : 0;
            found.most = turned > found.most ? turned : found.most;
            found.most = moved > found.most ? moved : found.most;
            found.mean += 0.5 * (turned + moved) / SIDE / SIDE;
        }
    free(masks);
    return found;
}

/* The source has 9 of 256 at most, of points at random. */
static void neighbours_differ_by_few_points(void **unused)
{
    (void)unused;
    for (int is_disk = 0; is_disk < 2; is_disk++) {
        const struct difference found = differences(is_disk);
        print_message("%s: neighbours differ by %d of 256 points at most, by %.3f on average\n",
                      is_disk ? "disk" : "rectangle", found.most, found.mean);
        assert_int_equal(found.most, is_disk ? 13 : 15);
        assert_float_equal(found.mean, is_disk ? 0.243 : 0.26, 1e-3);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_have_the_points_on_their_side),
        cmocka_unit_test(lines_that_miss_the_light_have_all_points_or_none),
        cmocka_unit_test(neighbours_differ_by_few_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* The grid of `area` on the device, against definitions in f64: every triangle that blocks a point
 * is in the point's cell, and what is left of each sample of a light is the product of what lies
 * before it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/shadows/area_grid.h"
#include "shaders/shared/layout.h"
#include "tests/support/area_stage.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

static struct shadow_rig rig;

/* The product of what lies before the sample; NAN: it hangs on rounding. */
static double pass(const struct area_stage *stage, uint32_t point, uint32_t sample)
{
    double at[3], passed = 1;
    bool hangs = false;
    area_stage_sample(stage, point, sample, at);
    area_stage_aim(stage, stage->points[point], at);
    if (!area_stage_is_before_light(stage, stage->points[point]))
        return 1;
    for (uint32_t i = 0; i < stage->triangle_count; i++) {
        enum area_meeting meeting =
            area_triangle_meet(&stage->triangles[i], stage->points[point], at);
        if (meeting == AREA_MEETS)
            passed *= stage->triangles[i].filter;
        hangs |= meeting == AREA_MEETING_HANGS;
    }
    return passed > 0 && hangs ? (double)NAN : passed;
}

static bool is_in_cell(const struct area_answer *answer, uint32_t point, uint32_t triangle)
{
    uint32_t cell = answer->places[point][0];
    if (cell == AREA_NOWHERE)
        return false;
    for (uint32_t i = answer->firsts[cell]; i < answer->firsts[cell + 1]; i++)
        if (answer->pairs[i] == triangle)
            return true;
    return false;
}

/* For places all over the light, corners among them. */
static void expect_blockers_in_cells(const struct area_stage *stage,
                                     const struct area_answer *answer)
{
    uint64_t seed = 5, blocking = 0;
    for (uint32_t p = 0; p < stage->point_count; p++) {
        for (int place = 0; place < 12 && area_stage_is_before_light(stage, stage->points[p]);
             place++) {
            double at[3], unit[2] = {place & 1, place >> 1 & 1};
            for (int k = 0; k < 2 && place >= 4; k++)
                unit[k] = rig_random(&seed);
            memcpy(at, stage->light.position, sizeof at);
            if (state_light_is_area(&stage->light))
                rt_light_place(&stage->light, unit, at);
            area_stage_aim(stage, stage->points[p], at);
            for (uint32_t i = 0; i < stage->triangle_count; i++) {
                if (area_triangle_meet(&stage->triangles[i], stage->points[p], at) != AREA_MEETS)
                    continue;
                blocking++;
                if (!is_in_cell(answer, p, i))
                    fail_msg("triangle %u blocks point %u, and is not in its cell", i, p);
            }
        }
    }
    assert_true(blocking > stage->point_count / 8);
}

static void expect_products(const struct area_stage *stage, const struct area_answer *answer)
{
    uint32_t open = 0, blocked = 0, hanging = 0, wrong = 0;
    for (uint32_t p = 0; p < stage->point_count; p++)
        for (uint32_t s = 0; s < stage->samples; s++) {
            double is = area_answer_filter(answer->filters[p * stage->samples + s]);
            double shall = pass(stage, p, s);
            if (!isfinite(shall)) {
                hanging++;
                continue;
            }
            open += shall > 0;
            blocked += shall == 0;
            if (fabs(is - shall) > 4e-6 * shall && ++wrong < 4)
                print_message("point %u sample %u: %g, not %g\n", p, s, is, shall);
        }
    print_message("%u open, %u blocked, %u hang on rounding\n", open, blocked, hanging);
    assert_int_equal(wrong, 0);
    assert_true(open > 0 && blocked > 0);
    assert_true(hanging * 10 < open + blocked);
}

/* ---- scenes ---- */

/* Of all sizes and shapes, about the origin; every third lets light through. */
static void add_random(struct area_stage *stage, uint32_t count, double reach, uint64_t seed)
{
    for (uint32_t i = 0; i < count; i++) {
        struct area_triangle *t = area_stage_add(stage, i % 3 ? 0 : 0.2 + 0.7 * rig_random(&seed));
        double middle[3], size = exp2(-4 * rig_random(&seed));
        for (int c = 0; c < 3; c++)
            middle[c] = reach * (2 * rig_random(&seed) - 1);
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                t->at[k][c] = middle[c] + size * (2 * rig_random(&seed) - 1);
    }
}

static void check_random(enum scene_light_type type, double height, double size, uint64_t seed)
{
    bool is_area = type == SCENE_LIGHT_RECT || type == SCENE_LIGHT_DISK;
    struct area_stage stage = {.light = area_stage_light(type, height, size),
                               .samples = is_area ? 16 : 1};
    add_random(&stage, 200, 2, seed);
    area_stage_scatter(&stage, 600, 3, seed + 1);
    struct area_answer answer = area_stage_must_ask(&rig, &stage);
    expect_blockers_in_cells(&stage, &answer);
    expect_products(&stage, &answer);
    area_answer_finish(&answer);
    area_stage_finish(&stage);
}

static void rectangles_and_disks(void **unused)
{
    (void)unused;
    for (uint64_t seed = 1; seed < 4; seed++) {
        check_random(SCENE_LIGHT_RECT, 3.5, 0.7, seed);
        check_random(SCENE_LIGHT_DISK, 3.5, 0.4, seed + 10);
        check_random(SCENE_LIGHT_RECT, 0.3, 0.5, seed + 20); /* among the triangles */
        check_random(SCENE_LIGHT_RECT, 3, 1e-3, seed + 30);
        check_random(SCENE_LIGHT_RECT, 40, 30, seed + 40);
    }
}

static void points_and_suns(void **unused)
{
    (void)unused;
    for (uint64_t seed = 1; seed < 4; seed++) {
        check_random(SCENE_LIGHT_POINT, 3.5, 0, seed);
        check_random(SCENE_LIGHT_POINT, 0.2, 0, seed + 10); /* on all six faces */
        check_random(SCENE_LIGHT_SPOT, 2, 0, seed + 20);
        check_random(SCENE_LIGHT_DIRECTIONAL, 0, 0, seed + 30);
    }
}

static void parts_of_a_grid_find_the_same(void **unused)
{
    (void)unused;
    struct area_stage stage = {.light = area_stage_light(SCENE_LIGHT_RECT, 3, 0.5), .samples = 16};
    add_random(&stage, 300, 2, 3);
    area_stage_scatter(&stage, 500, 3, 4);
    struct area_answer whole = area_stage_must_ask(&rig, &stage);
    assert_int_equal(whole.counts.parts, 1);
    stage.pairs_max = whole.counts.longest;
    struct area_answer parts = area_stage_must_ask(&rig, &stage),
                       again = area_stage_must_ask(&rig, &stage);
    assert_true(parts.counts.parts > 10);
    assert_int_equal(parts.counts.pairs, whole.counts.pairs);
    assert_memory_equal(parts.filters, whole.filters, 8ull * 16 * stage.point_count);
    assert_memory_equal(parts.filters, again.filters, 8ull * 16 * stage.point_count);
    area_answer_finish(&whole);
    area_answer_finish(&parts);
    area_answer_finish(&again);
    struct area_answer none;
    struct error err = {0};
    stage.pairs_max--;
    assert_false(area_stage_ask(&rig, &stage, &none, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    stage.pairs_max = 0;
    stage.loop_steps = 600;
    err = (struct error){0};
    assert_true(area_stage_ask(&rig, &stage, &none, &err) == (whole.counts.longest <= 88));
    if (!err.code)
        area_answer_finish(&none);
    area_stage_finish(&stage);
}

static uint32_t most_points_in_a_cell(const struct area_stage *stage,
                                      const struct area_answer *answer)
{
    uint32_t most = 0, cells = AREA_FACES * AREA_FACE_SIDE * AREA_FACE_SIDE;
    uint32_t *counts = calloc(cells, sizeof *counts);
    assert_non_null(counts);
    for (uint32_t p = 0; p < stage->point_count; p++) {
        uint32_t cell = answer->places[p][0];
        if (cell != AREA_NOWHERE && ++counts[cell] > most)
            most = counts[cell];
    }
    free(counts);
    return most;
}

/* Some places of a wide floor stretch the grid: the others would lie in a cell or two of even ones.
 */
static void cells_are_finer_where_points_are_many(void **unused)
{
    (void)unused;
    static const enum scene_light_type types[] = {SCENE_LIGHT_RECT, SCENE_LIGHT_POINT,
                                                  SCENE_LIGHT_DIRECTIONAL};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        bool is_area = types[i] == SCENE_LIGHT_RECT;
        struct area_stage stage = {.light = area_stage_light(types[i], 3, is_area ? 0.5 : 0),
                                   .samples = is_area ? 16 : 1};
        add_random(&stage, 200, 2, 31 + i);
        area_stage_scatter(&stage, 600, 2, 41 + i);
        for (int p = 0; p < 12; p++)
            for (int c = 0; c < 3; c += 2)
                stage.points[p][c] *= types[i] == SCENE_LIGHT_POINT ? 30 : 200;
        struct area_answer answer = area_stage_must_ask(&rig, &stage);
        uint32_t most = most_points_in_a_cell(&stage, &answer);
        print_message("at most %u of %u points in a cell\n", most, stage.point_count);
        assert_in_range(most, 1, stage.point_count / 10);
        expect_blockers_in_cells(&stage, &answer);
        expect_products(&stage, &answer);
        area_answer_finish(&answer);
        area_stage_finish(&stage);
    }
}

/* Two triangles of a pane: light through their common edge, and through the corners that they share
 * with the neighbours, is filtered once. */
static void shared_edges_filter_once(void **unused)
{
    (void)unused;
    struct area_stage stage = {.light = area_stage_light(SCENE_LIGHT_POINT, 2, 0), .samples = 1};
    enum { SIDE = 8 };
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            for (int half = 0; half < 2; half++) {
                const double a[2] = {x - SIDE / 2, y - SIDE / 2};
                const int corner[2][3][2] = {{{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 1}, {0, 1}}};
                struct area_triangle *t = area_stage_add(&stage, 0.5);
                for (int k = 0; k < 3; k++) {
                    t->at[k][0] = 0.25 * (a[0] + corner[half][k][0]);
                    t->at[k][1] = 1;
                    t->at[k][2] = 0.25 * (a[1] + corner[half][k][1]);
                }
            }
    memcpy(stage.light.position, (const double[3]){0, 2, 0}, sizeof stage.light.position);
    enum { POINTS = 4 * SIDE - 3 };
    stage.point_count = POINTS * POINTS;
    stage.points = calloc(stage.point_count, sizeof *stage.points);
    assert_non_null(stage.points);
    for (int i = 0; i < POINTS * POINTS; i++) { /* twice as far: on edges, corners and diagonals */
        stage.points[i][0] = 0.125 * (i % POINTS - POINTS / 2);
        stage.points[i][2] = 0.125 * (i / POINTS - POINTS / 2);
    }
    struct area_answer answer = area_stage_must_ask(&rig, &stage);
    for (uint32_t i = 0; i < stage.point_count; i++)
        if (area_answer_filter(answer.filters[i]) != 0.5)
            fail_msg("at %g, %g: %.9g", stage.points[i][0], stage.points[i][2],
                     area_answer_filter(answer.filters[i]));
    area_answer_finish(&answer);
    area_stage_finish(&stage);
}

/* An edge half way up: the share of the light that is seen past it, which is 0 or 1 outside of the
 * penumbra; of a disk, the area on one side of a chord. */
static void check_edge(bool is_disk)
{
    struct area_stage stage = {.samples = 256};
    struct state_light *light = &stage.light;
    *light = (struct state_light){.type = is_disk ? SCENE_LIGHT_DISK : SCENE_LIGHT_RECT,
                                  .position = {0, 2, 0},
                                  .direction = {0, -1, 0},
                                  .half_u = {0.5, 0, 0},
                                  .half_v = {0, 0, 0.5},
                                  .area_m2 = 1};
    const double wall[2][3][3] = {{{0, 1, -50}, {100, 1, -50}, {0, 1, 50}},
                                  {{100, 1, -50}, {100, 1, 50}, {0, 1, 50}}};
    for (int i = 0; i < 2; i++)
        memcpy(area_stage_add(&stage, 0)->at, wall[i], sizeof wall[i]);
    stage.point_count = 41;
    stage.points = calloc(stage.point_count, sizeof *stage.points);
    assert_non_null(stage.points);
    for (uint32_t i = 0; i < stage.point_count; i++) {
        stage.points[i][0] = 0.03 * ((double)i - 20);
        stage.points[i][2] = 0.013 * i;
    }
    struct area_answer answer = area_stage_must_ask(&rig, &stage);
    double bias = 0;
    for (uint32_t i = 0; i < stage.point_count; i++) {
        /* the edge is seen at -x on the light: what lies below is free */
        double at = fmin(fmax(-stage.points[i][0] / 0.5, -1), 1);
        double seen = is_disk ? 0.5 + (at * sqrt(1 - at * at) + asin(at)) / M_PI : 0.5 + 0.5 * at;
        double error = area_answer_mean(&stage, &answer, i) - seen;
        bias += error / stage.point_count;
        /* A strip of a square has its share of samples but for one. A chord of the disk crosses at
         * most 31 of the 256 squares with one each: a standard deviation of 0.009, here four. */
        assert_float_equal(error, 0, is_disk ? 0.036 : 1.01 / 256);
    }
    assert_float_equal(bias, 0, 0.004);
    area_answer_finish(&answer);
    area_stage_finish(&stage);
}

static void edges_cast_penumbrae(void **unused)
{
    (void)unused;
    check_edge(false);
    check_edge(true);
}

/* Nothing of no area, of the light's own plane, behind the light, behind or at the point counts. */
static void what_is_beside_blocks_nothing(void **unused)
{
    (void)unused;
    struct area_stage stage = {.samples = 16};
    stage.light = (struct state_light){.type = SCENE_LIGHT_RECT,
                                       .position = {0, 2, 0},
                                       .direction = {0, -1, 0},
                                       .half_u = {0.5, 0, 0},
                                       .half_v = {0, 0, 0.5},
                                       .area_m2 = 1};
    const double beside[][3][3] = {
        {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}},    {{-1, 1, 0}, {0, 1, 0}, {1, 1, 0}},
        {{-9, 2, -9}, {9, 2, -9}, {0, 2, 9}}, {{-9, 2.5, -9}, {9, 2.5, -9}, {0, 2.5, 9}},
        {{-9, 0, -9}, {9, 0, -9}, {0, 0, 9}}, {{-9, -1, -9}, {9, -1, -9}, {0, -1, 9}},
        {{3, -5, 1}, {3, 5, 1}, {3, 0, 4}},
    };
    for (size_t i = 0; i < sizeof beside / sizeof *beside; i++)
        memcpy(area_stage_add(&stage, 0)->at, beside[i], sizeof beside[i]);
    area_stage_scatter(&stage, 50, 1, 8);
    for (uint32_t i = 0; i < stage.point_count; i++)
        stage.points[i][1] = i % 2 ? 0 : 2.2; /* on a triangle, and behind the light */
    struct area_answer answer = area_stage_must_ask(&rig, &stage);
    for (uint32_t i = 0; i < stage.point_count; i++)
        assert_float_equal(area_answer_mean(&stage, &answer, i), 1, 0);
    area_answer_finish(&answer);
    area_stage_finish(&stage);
}

/* ---- as published ---- */

static uint32_t bits_that_differ(const struct area_answer *a, const struct area_answer *b,
                                 uint32_t point, uint32_t samples)
{
    uint32_t bits = 0;
    for (uint32_t s = point * samples; s < (point + 1) * samples; s++)
        bits += area_answer_filter(a->filters[s]) != area_answer_filter(b->filters[s]);
    return bits;
}

/* Opaque triangles by the table, and by planes to the same points of the light: a pane that is
 * beside of all lines asks for planes. */
static void check_table(enum scene_light_type type, uint32_t samples, double height, uint64_t seed)
{
    struct area_stage stage = {
        .light = area_stage_light(type, height, 0.5), .samples = samples, .is_faithful = true};
    uint32_t most = 0, sum = 0, shadowed = 0;
    int64_t lean = 0;
    add_random(&stage, 150, 2, seed);
    for (uint32_t i = 0; i < stage.triangle_count; i++)
        stage.triangles[i].filter = 0;
    area_stage_scatter(&stage, 400, 3, seed + 1);
    struct area_answer table = area_stage_must_ask(&rig, &stage);
    struct area_triangle *beside = area_stage_add(&stage, 0.5);
    const double at[3][3] = {{90, 40, 90}, {91, 40, 90}, {90, 40, 91}};
    memcpy(beside->at, at, sizeof at);
    struct area_answer planes = area_stage_must_ask(&rig, &stage);
    for (uint32_t p = 0; p < stage.point_count; p++) {
        uint32_t bits = bits_that_differ(&table, &planes, p, samples);
        double mean = area_answer_mean(&stage, &planes, p);
        sum += bits;
        most = bits > most ? bits : most;
        shadowed += mean > 0 && mean < 1;
        lean += (int64_t)rint(samples * (area_answer_mean(&stage, &table, p) - mean));
    }
    double share = (double)sum / stage.point_count / samples;
    print_message("%u points of the light, %u places in penumbra: %u differ at most, %.4f %% on "
                  "average, lean %.4f %%\n",
                  samples, shadowed, most, 100 * share,
                  100.0 * (double)lean / stage.point_count / samples);
    assert_true(shadowed > stage.point_count / 8);
    assert_true(share > 0 && share < 2e-3);
    assert_true(most <= samples / 16);
    assert_true(llabs(lean) < sum / 2);
    area_answer_finish(&table);
    area_answer_finish(&planes);
    area_stage_finish(&stage);
}

static void tables_have_the_masks_of_planes(void **unused)
{
    (void)unused;
    for (uint64_t seed = 1; seed < 3; seed++) {
        check_table(SCENE_LIGHT_RECT, 256, 3.5, seed);
        check_table(SCENE_LIGHT_DISK, 256, 3.5, seed + 10);
        check_table(SCENE_LIGHT_RECT, 100, 0.3, seed + 20); /* among the triangles */
    }
}

/* One more triangle than loops of old llvmpipe walk in steps of samples and edges. */
static void many_triangles_of_one_cell_all_count(void **unused)
{
    (void)unused;
    struct area_stage stage = {.light = area_stage_light(SCENE_LIGHT_RECT, 2, 0.3), .samples = 16};
    enum { MANY = 30000 };
    for (int i = 0; i < MANY; i++) {
        struct area_triangle *t = area_stage_add(&stage, i == MANY - 1 ? 0.25 : 0.999999);
        const double at[3][3] = {{-9, 1, -9}, {9, 1, -9}, {0, 1, 18}};
        memcpy(t->at, at, sizeof at);
    }
    area_stage_scatter(&stage, 8, 0.2, 8);
    struct area_answer answer = area_stage_must_ask(&rig, &stage);
    assert_int_equal(answer.counts.longest, MANY);
    for (uint32_t i = 0; i < stage.point_count; i++)
        assert_float_equal(
            area_answer_mean(&stage, &answer, i),
            0.25 * exp2(-(MANY - 1) * rint(-log2(0.999999) * AREA_LOG_ONE) / AREA_LOG_ONE), 1e-5);
    area_answer_finish(&answer);
    area_stage_finish(&stage);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectangles_and_disks),
        cmocka_unit_test(points_and_suns),
        cmocka_unit_test(parts_of_a_grid_find_the_same),
        cmocka_unit_test(cells_are_finer_where_points_are_many),
        cmocka_unit_test(shared_edges_filter_once),
        cmocka_unit_test(edges_cast_penumbrae),
        cmocka_unit_test(what_is_beside_blocks_nothing),
        cmocka_unit_test(tables_have_the_masks_of_planes),
        cmocka_unit_test(many_triangles_of_one_cell_all_count),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}

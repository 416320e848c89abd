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
#include "tests/support/shadow_rig.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum { WIDTH = 64, BOTTOM = 1000, FIRST_COLUMN = 17 };

static struct shadow_rig rig;

struct triangle {
    double at[3][3];
    double filter; /* of all channels, 0: opaque */
};

struct stage { /* triangles, points and a light */
    struct triangle *triangles;
    uint32_t triangle_count;
    double (*points)[3];
    uint32_t point_count;
    struct state_light light;
    uint32_t samples;
    uint64_t pairs_max;
    uint32_t loop_steps;
};

struct answer { /* of the device */
    uint32_t (*filters)[2], (*places)[2], *firsts, *pairs;
    struct area_counts counts;
};

static void must(bool ok, const struct error *err)
{
    if (!ok)
        fail_msg("%s", err->message);
}

static void make(struct gl_buffer *buffer, const char *label, uint64_t bytes, const void *data)
{
    struct error err = {0};
    must(gl_buffer_init(buffer,
                        &(struct gl_buffer_desc){
                            .label = label, .size_bytes = bytes, .data = data, .is_dynamic = true},
                        &err),
         &err);
}

static uint32_t float_bits(double value)
{
    float f = (float)value;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return bits;
}

/* One caster for each triangle. Positions become what the device has. */
static void put_casters(struct stage *stage, struct area_casters *casters)
{
    uint32_t count = stage->triangle_count;
    uint32_t(*corners)[4] = calloc(3 * (size_t)count + 1, sizeof *corners);
    uint32_t *owners = calloc(count + (size_t)1, sizeof *owners);
    struct area_caster *items = calloc(count + (size_t)1, sizeof *items);
    assert_true(corners && owners && items);
    for (uint32_t i = 0; i < count; i++) {
        struct triangle *t = &stage->triangles[i];
        owners[i] = i;
        items[i].flags = (t->filter > 0 ? 0 : AREA_CASTER_OPAQUE) | (i + 1) << AREA_CASTER_NODE;
        items[i].log_r = items[i].log_g = items[i].log_b =
            t->filter > 0 ? (uint32_t)rint(-log2(t->filter) * AREA_LOG_ONE) : AREA_LOG_MOST;
        casters->has_filters |= t->filter > 0;
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++) {
                t->at[k][c] = (double)(float)t->at[k][c];
                corners[3 * i + (uint32_t)k][c] = float_bits(t->at[k][c]);
            }
        corners[3 * i][3] = AREA_FLAT;
    }
    make(&casters->corners, "corners", 48ull * count, corners);
    make(&casters->owners, "owners", 4ull * count, owners);
    make(&casters->items, "items", sizeof *items * (uint64_t)count, items);
    casters->triangle_count = casters->item_count = count;
    casters->radius_m = 4;
    casters->nudge_m = 1e-6;
    casters->size_m = 50;
    free(corners);
    free(owners);
    free(items);
}

static void put_points(struct stage *stage, struct area_grid *grid, struct gl_buffer *points,
                       struct gl_buffer *table)
{
    uint32_t count = stage->point_count;
    struct shadow_point *p = calloc(count, sizeof *p);
    struct area_start *starts = calloc(count, sizeof *starts);
    uint32_t(*rows)[2] = calloc(count, sizeof *rows);
    assert_true(p && starts && rows);
    for (uint32_t i = 0; i < count; i++) {
        p[i].pixel_roughness = i;
        p[i].flags = SHADOW_POINT_TRANSMITS; /* light from everywhere counts */
        rows[i][0] = i * stage->samples;
        starts[i].normal_y = 1;
        starts[i].skip = AREA_NOWHERE;
        starts[i].origin_offset.v[3] = 1e-5f;
        for (int k = 0; k < 3; k++) {
            stage->points[i][k] = (double)(float)stage->points[i][k];
            starts[i].origin_offset.v[k] = (float)stage->points[i][k];
        }
    }
    make(points, "points", sizeof *p * count, p);
    make(table, "table", 8ull * count, rows);
    make(&grid->starts, "starts", sizeof *starts * count, starts);
    free(p);
    free(starts);
    free(rows);
}

static void *read_all(const struct gl_buffer *buffer)
{
    void *bytes = calloc(1, buffer->size_bytes);
    assert_non_null(bytes);
    gl_buffer_read(buffer, 0, buffer->size_bytes, bytes);
    return bytes;
}

static bool ask(struct stage *stage, struct answer *answer, struct error *err)
{
    struct area_grid grid = {.pairs_max = stage->pairs_max};
    struct area_casters casters = {.triangle_count = 0};
    struct scene_state state = {.light_count = 1};
    struct camera camera = {
        .right = {1, 0, 0}, .up = {0, 1, 0}, .back = {0, 0, 1}, .half_height = 1};
    struct gl_buffer points = {0}, table = {0}, filters = {0};
    put_casters(stage, &casters);
    put_points(stage, &grid, &points, &table);
    make(&filters, "filters", 8ull * stage->point_count * stage->samples, NULL);
    const struct area_grid_desc desc = {
        .programs = rig.programs,
        .limits = gl_context_limits(rig.context),
        .casters = &casters,
        .state = &state,
        .camera = &camera,
        .image_height_px = 100,
        .points = {.points = &points,
                   .count = stage->point_count,
                   .width = WIDTH,
                   .image_x = FIRST_COLUMN,
                   .image_y_bottom = BOTTOM},
        .table = &table,
        .filters = &filters,
        .loop_steps = stage->loop_steps,
    };
    const struct area_light light = area_light_of(&stage->light, 0, stage->samples, &casters);
    bool ok = area_grid_find(&grid, &desc, &light, err);
    if (ok)
        *answer = (struct answer){.filters = read_all(&filters),
                                  .places = read_all(&grid.places),
                                  .firsts = read_all(&grid.firsts),
                                  .pairs = read_all(&grid.pairs),
                                  .counts = grid.counts_of_frame};
    gl_buffer_finish(&points);
    gl_buffer_finish(&table);
    gl_buffer_finish(&filters);
    area_casters_finish(&casters);
    area_grid_finish(&grid);
    return ok;
}

static struct answer must_ask(struct stage *stage)
{
    struct error err = {0};
    struct answer answer = {.filters = NULL};
    must(ask(stage, &answer, &err), &err);
    return answer;
}

static void answer_finish(struct answer *answer)
{
    free(answer->filters);
    free(answer->places);
    free(answer->firsts);
    free(answer->pairs);
}

static void stage_finish(struct stage *stage)
{
    free(stage->triangles);
    free(stage->points);
}

/* traced_filter.glsl: the first channel. */
static double filter_of(const uint32_t words[2])
{
    return ldexp(words[0] & ((1u << TRACED_FILTER_BITS) - 1),
                 1 - TRACED_FILTER_BITS - (int)(words[1] >> (3 * TRACED_FILTER_BITS - 32)));
}

/* ---- the definition ---- */

enum meeting { MEETS_NOT, MEETS, HANGS_ON_ROUNDING };

/* The segment from a point to a place on the light. */
static enum meeting meet(const struct triangle *t, const double from[3], const double to[3])
{
    const double hair = 2e-5;
    double way[3], e1[3], e2[3], s[3], across[3], q[3], normal[3];
    vec3_sub(to, from, way);
    vec3_sub(t->at[1], t->at[0], e1);
    vec3_sub(t->at[2], t->at[0], e2);
    vec3_sub(from, t->at[0], s);
    vec3_cross(way, e2, across);
    vec3_cross(e1, e2, normal);
    double det = vec3_dot(e1, across), size = vec3_length(normal) * vec3_length(way);
    if (!(size > 0))
        return MEETS_NOT;
    vec3_cross(s, e1, q);
    double u = vec3_dot(s, across) / det, v = vec3_dot(way, q) / det, w = vec3_dot(e2, q) / det;
    double longest = fmax(vec3_length(e1), vec3_length(e2));
    double slim = 1e-5 * longest * (longest + vec3_length(s)) / vec3_length(normal);
    double inside = fmin(fmin(u, v), 1 - u - v), before = fmin(w - 2e-5, 1 - w);
    double edge = (hair + slim) / fmin(1, fabs(det) / size + 1e-12);
    if (inside < -edge || before < -1e-3)
        return MEETS_NOT;
    return inside > edge && before > 1e-3 ? MEETS : HANGS_ON_ROUNDING;
}

static void sample_of(const struct stage *stage, uint32_t point, uint32_t index, double at[3])
{
    double unit[2];
    memcpy(at, stage->light.position, 3 * sizeof *at);
    if (stage->samples == 1)
        return;
    int x = FIRST_COLUMN + (int)(point % WIDTH), y = BOTTOM - (int)(point / WIDTH);
    rt_sequence_point(index, rt_job_seed(x, y, 0), unit);
    rt_light_place(&stage->light, unit, at);
}

/* A place on the light, seen from a point: for parallel light far away. */
static void aim(const struct stage *stage, const double point[3], double at[3])
{
    if (stage->light.type != SCENE_LIGHT_DIRECTIONAL)
        return;
    for (int k = 0; k < 3; k++)
        at[k] = point[k] - 49 * stage->light.direction[k];
}

static bool is_before_light(const struct stage *stage, const double point[3])
{
    double way[3];
    vec3_sub(point, stage->light.position, way);
    return !state_light_is_area(&stage->light) || vec3_dot(way, stage->light.direction) > 1e-5;
}

/* The product of what lies before the sample; NAN: it hangs on rounding. */
static double pass(const struct stage *stage, uint32_t point, uint32_t sample)
{
    double at[3], passed = 1;
    bool hangs = false;
    sample_of(stage, point, sample, at);
    aim(stage, stage->points[point], at);
    if (!is_before_light(stage, stage->points[point]))
        return 1;
    for (uint32_t i = 0; i < stage->triangle_count; i++) {
        enum meeting meeting = meet(&stage->triangles[i], stage->points[point], at);
        if (meeting == MEETS)
            passed *= stage->triangles[i].filter;
        hangs |= meeting == HANGS_ON_ROUNDING;
    }
    return passed > 0 && hangs ? (double)NAN : passed;
}

static bool is_in_cell(const struct answer *answer, uint32_t point, uint32_t triangle)
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
static void expect_blockers_in_cells(const struct stage *stage, const struct answer *answer)
{
    uint64_t seed = 5, blocking = 0;
    for (uint32_t p = 0; p < stage->point_count; p++) {
        for (int place = 0; place < 12 && is_before_light(stage, stage->points[p]); place++) {
            double at[3], unit[2] = {place & 1, place >> 1 & 1};
            for (int k = 0; k < 2 && place >= 4; k++)
                unit[k] = rig_random(&seed);
            memcpy(at, stage->light.position, sizeof at);
            if (state_light_is_area(&stage->light))
                rt_light_place(&stage->light, unit, at);
            aim(stage, stage->points[p], at);
            for (uint32_t i = 0; i < stage->triangle_count; i++) {
                if (meet(&stage->triangles[i], stage->points[p], at) != MEETS)
                    continue;
                blocking++;
                if (!is_in_cell(answer, p, i))
                    fail_msg("triangle %u blocks point %u, and is not in its cell", i, p);
            }
        }
    }
    assert_true(blocking > stage->point_count / 8);
}

static void expect_products(const struct stage *stage, const struct answer *answer)
{
    uint32_t open = 0, blocked = 0, hanging = 0, wrong = 0;
    for (uint32_t p = 0; p < stage->point_count; p++)
        for (uint32_t s = 0; s < stage->samples; s++) {
            double is = filter_of(answer->filters[p * stage->samples + s]);
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

static struct triangle *add(struct stage *stage, double filter)
{
    stage->triangles =
        realloc(stage->triangles, (stage->triangle_count + (size_t)1) * sizeof(struct triangle));
    assert_non_null(stage->triangles);
    struct triangle *t = &stage->triangles[stage->triangle_count++];
    *t = (struct triangle){.filter = filter};
    return t;
}

/* Of all sizes and shapes, about the origin; every third lets light through. */
static void add_random(struct stage *stage, uint32_t count, double reach, uint64_t seed)
{
    for (uint32_t i = 0; i < count; i++) {
        struct triangle *t = add(stage, i % 3 ? 0 : 0.2 + 0.7 * rig_random(&seed));
        double middle[3], size = exp2(-4 * rig_random(&seed));
        for (int c = 0; c < 3; c++)
            middle[c] = reach * (2 * rig_random(&seed) - 1);
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                t->at[k][c] = middle[c] + size * (2 * rig_random(&seed) - 1);
    }
}

static void scatter_points(struct stage *stage, uint32_t count, double reach, uint64_t seed)
{
    stage->points = calloc(count, sizeof *stage->points);
    assert_non_null(stage->points);
    stage->point_count = count;
    for (uint32_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            stage->points[i][c] = reach * (2 * rig_random(&seed) - 1);
}

/* Shines down, a little askew. */
static struct state_light light_at(enum scene_light_type type, double height, double size)
{
    struct state_light light = {.type = type, .position = {0.1, height, -0.2}};
    double turned[3] = {0.2, -1, 0.1}, u[3], v[3];
    vec3_normalize(turned);
    memcpy(light.direction, turned, sizeof turned);
    vec3_cross(turned, (const double[3]){0.3, 0.2, 1}, u);
    vec3_normalize(u);
    vec3_cross(turned, u, v);
    for (int k = 0; k < 3; k++) {
        light.half_u[k] = size * u[k];
        light.half_v[k] = (type == SCENE_LIGHT_DISK ? 1 : 0.6) * size * v[k];
    }
    light.area_m2 = size * size;
    return light;
}

static void check_random(enum scene_light_type type, double height, double size, uint64_t seed)
{
    bool is_area = type == SCENE_LIGHT_RECT || type == SCENE_LIGHT_DISK;
    struct stage stage = {.light = light_at(type, height, size), .samples = is_area ? 16 : 1};
    add_random(&stage, 200, 2, seed);
    scatter_points(&stage, 600, 3, seed + 1);
    struct answer answer = must_ask(&stage);
    expect_blockers_in_cells(&stage, &answer);
    expect_products(&stage, &answer);
    answer_finish(&answer);
    stage_finish(&stage);
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
    struct stage stage = {.light = light_at(SCENE_LIGHT_RECT, 3, 0.5), .samples = 16};
    add_random(&stage, 300, 2, 3);
    scatter_points(&stage, 500, 3, 4);
    struct answer whole = must_ask(&stage);
    assert_int_equal(whole.counts.parts, 1);
    stage.pairs_max = whole.counts.longest;
    struct answer parts = must_ask(&stage), again = must_ask(&stage);
    assert_true(parts.counts.parts > 10);
    assert_int_equal(parts.counts.pairs, whole.counts.pairs);
    assert_memory_equal(parts.filters, whole.filters, 8ull * 16 * stage.point_count);
    assert_memory_equal(parts.filters, again.filters, 8ull * 16 * stage.point_count);
    answer_finish(&whole);
    answer_finish(&parts);
    answer_finish(&again);
    struct answer none;
    struct error err = {0};
    stage.pairs_max--;
    assert_false(ask(&stage, &none, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    stage.pairs_max = 0;
    stage.loop_steps = 600;
    err = (struct error){0};
    assert_true(ask(&stage, &none, &err) == (whole.counts.longest <= 88));
    if (!err.code)
        answer_finish(&none);
    stage_finish(&stage);
}

/* Two triangles of a pane: light through their common edge, and through the corners that they share
 * with the neighbours, is filtered once. */
static void shared_edges_filter_once(void **unused)
{
    (void)unused;
    struct stage stage = {.light = light_at(SCENE_LIGHT_POINT, 2, 0), .samples = 1};
    enum { SIDE = 8 };
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            for (int half = 0; half < 2; half++) {
                const double a[2] = {x - SIDE / 2, y - SIDE / 2};
                const int corner[2][3][2] = {{{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 1}, {0, 1}}};
                struct triangle *t = add(&stage, 0.5);
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
    struct answer answer = must_ask(&stage);
    for (uint32_t i = 0; i < stage.point_count; i++)
        if (filter_of(answer.filters[i]) != 0.5)
            fail_msg("at %g, %g: %.9g", stage.points[i][0], stage.points[i][2],
                     filter_of(answer.filters[i]));
    answer_finish(&answer);
    stage_finish(&stage);
}

static double mean_at(const struct stage *stage, const struct answer *answer, uint32_t point)
{
    double sum = 0;
    for (uint32_t s = 0; s < stage->samples; s++)
        sum += filter_of(answer->filters[point * stage->samples + s]);
    return sum / stage->samples;
}

/* An edge half way up: the share of the light that is seen past it, which is 0 or 1 outside of the
 * penumbra; of a disk, the area on one side of a chord. */
static void check_edge(bool is_disk)
{
    struct stage stage = {.samples = 256};
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
        memcpy(add(&stage, 0)->at, wall[i], sizeof wall[i]);
    stage.point_count = 41;
    stage.points = calloc(stage.point_count, sizeof *stage.points);
    assert_non_null(stage.points);
    for (uint32_t i = 0; i < stage.point_count; i++) {
        stage.points[i][0] = 0.03 * ((double)i - 20);
        stage.points[i][2] = 0.013 * i;
    }
    struct answer answer = must_ask(&stage);
    double bias = 0;
    for (uint32_t i = 0; i < stage.point_count; i++) {
        /* the edge is seen at -x on the light: what lies below is free */
        double at = fmin(fmax(-stage.points[i][0] / 0.5, -1), 1);
        double seen = is_disk ? 0.5 + (at * sqrt(1 - at * at) + asin(at)) / M_PI : 0.5 + 0.5 * at;
        double error = mean_at(&stage, &answer, i) - seen;
        bias += error / stage.point_count;
        /* A strip of a square has its share of samples but for one. A chord of the disk crosses at
         * most 31 of the 256 squares with one each: a standard deviation of 0.009, here four. */
        assert_float_equal(error, 0, is_disk ? 0.036 : 1.01 / 256);
    }
    assert_float_equal(bias, 0, 0.004);
    answer_finish(&answer);
    stage_finish(&stage);
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
    struct stage stage = {.samples = 16};
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
        memcpy(add(&stage, 0)->at, beside[i], sizeof beside[i]);
    scatter_points(&stage, 50, 1, 8);
    for (uint32_t i = 0; i < stage.point_count; i++)
        stage.points[i][1] = i % 2 ? 0 : 2.2; /* on a triangle, and behind the light */
    struct answer answer = must_ask(&stage);
    for (uint32_t i = 0; i < stage.point_count; i++)
        assert_float_equal(mean_at(&stage, &answer, i), 1, 0);
    answer_finish(&answer);
    stage_finish(&stage);
}

/* One more triangle than loops of old llvmpipe walk in steps of samples and edges. */
static void many_triangles_of_one_cell_all_count(void **unused)
{
    (void)unused;
    struct stage stage = {.light = light_at(SCENE_LIGHT_RECT, 2, 0.3), .samples = 16};
    enum { MANY = 30000 };
    for (int i = 0; i < MANY; i++) {
        struct triangle *t = add(&stage, i == MANY - 1 ? 0.25 : 0.999999);
        const double at[3][3] = {{-9, 1, -9}, {9, 1, -9}, {0, 1, 18}};
        memcpy(t->at, at, sizeof at);
    }
    scatter_points(&stage, 8, 0.2, 8);
    struct answer answer = must_ask(&stage);
    assert_int_equal(answer.counts.longest, MANY);
    for (uint32_t i = 0; i < stage.point_count; i++)
        assert_float_equal(
            mean_at(&stage, &answer, i),
            0.25 * exp2(-(MANY - 1) * rint(-log2(0.999999) * AREA_LOG_ONE) / AREA_LOG_ONE), 1e-5);
    answer_finish(&answer);
    stage_finish(&stage);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectangles_and_disks),
        cmocka_unit_test(points_and_suns),
        cmocka_unit_test(parts_of_a_grid_find_the_same),
        cmocka_unit_test(shared_edges_filter_once),
        cmocka_unit_test(edges_cast_penumbrae),
        cmocka_unit_test(what_is_beside_blocks_nothing),
        cmocka_unit_test(many_triangles_of_one_cell_all_count),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}

/* SPDX-License-Identifier: MIT */
/* What Wang et al. 2014 measure of their grid that no machine decides (tables 4, 8 and 9, figure 9
 * and section 5), on scenes of our own: the device's lists against the definition in f64, and that
 * against brute force. docs/notebook/2026-11-accuracy.md has the figures beside the source's. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_emitter.h"
#include "shaders/shared/layout.h"
#include "tests/support/area_model.h"
#include "tests/support/light_scene.h"

#include "shaders/shared/records.h"

enum { SAMPLES = 256, PICTURE = 96, CELLS = AREA_SIDE * AREA_SIDE };

static struct shadow_rig rig;

/* ---- scenes ---- */

static void add_spheres(struct shape *shape)
{
    for (int i = 0; i < 100; i++)
        shape_add_sphere(shape, (double[]){(i % 10) - 4.5, 0.6 + 0.4 * (i % 7), (i / 10) - 4.5},
                         0.35, 20, 12);
}

static void add_sticks(struct shape *shape)
{
    uint64_t seed = 5;
    for (int i = 0; i < 250; i++) {
        double around = random_uniform(&seed, 0, 2 * M_PI), rise = random_uniform(&seed, -0.3, 0.3);
        const double along[3] = {cos(around) * cos(rise), sin(rise), sin(around) * cos(rise)};
        const double across[3] = {-sin(around), 0, cos(around)};
        const double at[3] = {random_uniform(&seed, -2.5, 2.5), random_uniform(&seed, 0.5, 3.5),
                              random_uniform(&seed, -2.5, 2.5)};
        shape_set_place(shape, at, across, along);
        for (int part = 0; part < 8; part++)
            shape_add_cylinder(shape, (double[]){0, 0.25 * part, 0}, 0.05, 0.25, 6);
    }
    shape_set_place(shape, NULL, NULL, NULL);
}

/* Thirty-two pieces in the rows of a board. */
static void add_pieces(struct shape *shape)
{
    static const double profile[][2] = {{0, 0},       {0.36, 0},    {0.36, 0.1}, {0.2, 0.25},
                                        {0.14, 0.7},  {0.24, 0.78}, {0.1, 0.85}, {0.25, 1.05},
                                        {0.22, 1.25}, {0, 1.35}};
    const struct shape_lathe_desc piece = {.profile = profile, .count = 10, .slices = 14};
    for (int i = 0; i < 32; i++) {
        int row = i / 8 < 2 ? i / 8 : i / 8 + 4;
        shape_set_place(shape, (double[]){i % 8 - 3.5, 0, row - 3.5}, NULL, NULL);
        shape_add_lathe(shape, &piece);
    }
    shape_set_place(shape, NULL, NULL, NULL);
}

static void add_shape(struct area_stage *stage, const struct shape *shape)
{
    assert_false(shape->is_out_of_memory);
    for (size_t i = 0; i < shape->index_count; i += 3) {
        struct area_triangle *t = area_stage_add(stage, 0);
        for (size_t k = 0; k < 9; k++)
            t->at[k / 3][k % 3] = (double)shape->positions[3 * shape->indices[i + k / 3] + k % 3];
    }
}

/* Where the line meets the triangle, in units of the way; INFINITY: it does not. */
static double distance_to(const struct area_triangle *t, const double from[3], const double way[3])
{
    double e1[3], e2[3], s[3], across[3], q[3];
    vec3_sub(t->at[1], t->at[0], e1);
    vec3_sub(t->at[2], t->at[0], e2);
    vec3_sub(from, t->at[0], s);
    vec3_cross(way, e2, across);
    vec3_cross(s, e1, q);
    double det = vec3_dot(e1, across), u = vec3_dot(s, across) / det, v = vec3_dot(way, q) / det;
    double w = vec3_dot(e2, q) / det;
    return u >= 0 && v >= 0 && u + v <= 1 && w > 0 ? w : INFINITY;
}

/* The point that a pixel of a picture from (5, 5, 6) shows, a millimetre before its surface. */
static bool see(const struct area_stage *stage, double x, double y, double point[3])
{
    const double eye[3] = {5, 5, 6}, back[3] = {5, 4.5, 6}, up[3] = {0, 1, 0};
    double axes[3][3], way[3], nearest = INFINITY;
    memcpy(axes[2], back, sizeof back);
    vec3_normalize(axes[2]);
    vec3_cross(up, axes[2], axes[0]);
    vec3_normalize(axes[0]);
    vec3_cross(axes[2], axes[0], axes[1]);
    for (int k = 0; k < 3; k++)
        way[k] = 0.47 * (x * axes[0][k] + y * axes[1][k]) - axes[2][k];
    for (uint32_t i = 0; i < stage->triangle_count; i++)
        nearest = fmin(nearest, distance_to(&stage->triangles[i], eye, way));
    for (int k = 0; k < 3; k++)
        point[k] = eye[k] + way[k] * (nearest - 1e-3);
    return isfinite(nearest);
}

static const struct figures { /* as this test finds them; shares of one */
    const char *name;
    void (*add)(struct shape *shape);
    /* of the definition; triangles of a cell, points of a cell */
    uint64_t triangles_most, points_most;
    double triangles_mean, points_mean;
    double needed;         /* of the pairs of a point and a triangle */
    double needed_by_cell; /* with an extrusion for each cell */
    double hull_excess[2]; /* points in rectangles that are in no hull; under a light of four times
                              the side */
    double saved;          /* pairs that the correction keeps off, over those not needed */
    uint32_t table_most;   /* points of the light that a table has wrong, of 256: at most, ... */
    double table_mean;     /* ... on average */
} scenes[] = {
    {.name = "spheres",
     .add = add_spheres,
     .triangles_most = 246,
     .points_most = 33,
     .triangles_mean = 33.67,
     .points_mean = 2.304,
     .needed = 0.1378,
     .needed_by_cell = 0.1519,
     .hull_excess = {0.3009, 0.0844},
     .saved = 1.2122,
     .table_most = 5,
     .table_mean = 0.0124},
    {.name = "sticks",
     .add = add_sticks,
     .triangles_most = 368,
     .points_most = 9,
     .triangles_mean = 77.27,
     .points_mean = 1.86,
     .needed = 0.2011,
     .needed_by_cell = 0.224,
     .hull_excess = {0.2703, 0.0375},
     .saved = 0.9321,
     .table_most = 5,
     .table_mean = 0.0668},
    {.name = "pieces",
     .add = add_pieces,
     .triangles_most = 58,
     .points_most = 20,
     .triangles_mean = 6.1,
     .points_mean = 1.563,
     .needed = 0.0875,
     .needed_by_cell = 0.093,
     .hull_excess = {0.6998, 0.213},
     .saved = 0.8394,
     .table_most = 5,
     .table_mean = 0.002},
};

static void set_up(struct area_stage *stage, const struct figures *scene)
{
    struct shape casters = {0}, floor = {0};
    *stage = (struct area_stage){
        .light = {.type = SCENE_LIGHT_RECT, .position = {2, 9, 1}, .direction = {-0.2, -1, -0.1}},
        .samples = SAMPLES,
        .is_faithful = true};
    struct state_light *light = &stage->light;
    double across[3] = {0, 0, 1};
    vec3_normalize(light->direction);
    vec3_cross(across, light->direction, light->half_u);
    vec3_normalize(light->half_u);
    vec3_cross(light->direction, light->half_u, light->half_v);
    for (int k = 0; k < 3; k++) {
        light->half_u[k] *= 0.25;
        light->half_v[k] *= 0.25;
    }
    light->area_m2 = 0.25;
    scene->add(&casters);
    shape_add_quad(&floor, (double[]){-9, 0, -9}, (double[]){0, 0, 18}, (double[]){18, 0, 0});
    add_shape(stage, &casters);
    add_shape(stage, &floor);
    shape_finish(&casters);
    shape_finish(&floor);
    stage->points = calloc((size_t)PICTURE * PICTURE, sizeof *stage->points);
    assert_non_null(stage->points);
    for (int i = 0; i < PICTURE * PICTURE; i++) {
        double x = 2 * (i % PICTURE + 0.5) / PICTURE - 1, y = 1 - 2 * (i / PICTURE + 0.5) / PICTURE;
        stage->point_count += see(stage, x, y, stage->points[stage->point_count]);
    }
}

/* ---- lists of the device ---- */

/* Of each triangle, from `first` on: the cells whose lists have it. */
struct triangle_lists {
    uint32_t *firsts, *cells;
};

static void sort_lists(const struct area_answer *answer, uint32_t triangles,
                       struct triangle_lists *lists)
{
    const uint32_t count = answer->firsts[CELLS];
    uint32_t *at = calloc(triangles + (size_t)1, sizeof *at);
    lists->firsts = calloc(triangles + (size_t)1, sizeof *lists->firsts);
    lists->cells = calloc(count + (size_t)1, sizeof *lists->cells);
    assert_true(at && lists->firsts && lists->cells);
    for (uint32_t i = 0; i < count; i++)
        lists->firsts[answer->pairs[i] + 1]++;
    for (uint32_t i = 0; i < triangles; i++)
        at[i + 1] = lists->firsts[i + 1] += lists->firsts[i];
    for (uint32_t cell = 0; cell < CELLS; cell++)
        for (uint32_t i = answer->firsts[cell]; i < answer->firsts[cell + 1]; i++)
            lists->cells[at[answer->pairs[i]]++] = cell;
    free(at);
}

enum { IN_DEVICE = 1, IN_DEFINITION = 2, IN_MARGINS = 4 };

struct marking {
    uint8_t cells[CELLS]; /* IN_* */
    uint8_t mark;
};

static void mark_cell(void *context, uint32_t cell)
{
    struct marking *marking = context;
    marking->cells[cell] |= marking->mark;
}

/* All pairs of the definition are the device's; those of the device that are not come of what it
 * widens rectangles by for rounding. */
static void compare_lists(const struct area_stage *stage, const struct area_answer *answer,
                          const struct area_model *model)
{
    const struct area_margins none = {.place = 0}, wide = {.place = 1e-4, .depth_m = 1e-3};
    static struct marking marking;
    struct triangle_lists lists;
    uint64_t pairs = 0, more = 0;
    sort_lists(answer, stage->triangle_count, &lists);
    for (uint32_t i = 0; i < stage->triangle_count; i++) {
        memset(marking.cells, 0, sizeof marking.cells);
        for (uint32_t k = lists.firsts[i]; k < lists.firsts[i + 1]; k++)
            marking.cells[lists.cells[k]] = IN_DEVICE;
        marking.mark = IN_DEFINITION;
        area_model_assign(model, &stage->triangles[i], AREA_EXTRUDE_CELLS, none, mark_cell,
                          &marking);
        marking.mark = IN_MARGINS;
        area_model_assign(model, &stage->triangles[i], AREA_EXTRUDE_CELLS, wide, mark_cell,
                          &marking);
        for (uint32_t cell = 0; cell < CELLS; cell++) {
            uint8_t mark = marking.cells[cell];
            if ((mark & IN_DEFINITION && !(mark & IN_DEVICE)) ||
                (mark & IN_DEVICE && !(mark & IN_MARGINS)))
                fail_msg("triangle %u, cell %u: %u", i, cell, mark);
            pairs += (mark & IN_DEFINITION) != 0;
            more += (mark & (IN_DEVICE | IN_DEFINITION)) == IN_DEVICE;
        }
    }
    print_message("  %llu pairs of a cell and a triangle, %.2f %% more on the device\n",
                  (unsigned long long)pairs, 100 * (double)more / (double)pairs);
    assert_true(more * 100 < pairs);
    free(lists.firsts);
    free(lists.cells);
}

/* Points whose cells the device has otherwise than f64 lie on a border. */
static void compare_cells(const struct area_answer *answer, const struct area_model *model)
{
    uint32_t others = 0;
    for (uint32_t i = 0; i < model->point_count; i++)
        others += answer->places[i][0] != area_model_cell(model, model->places[i]);
    print_message("  %u of %u points in other cells\n", others, model->point_count);
    assert_true(others * 200 < model->point_count);
}

/* ---- counts ---- */

struct counting {
    const struct area_model *model;
    uint32_t *triangles; /* of each cell; optional */
    uint64_t cells, points;
};

static void count_cell(void *context, uint32_t cell)
{
    struct counting *counting = context;
    counting->cells++;
    counting->points += counting->model->cell_points[cell];
    if (counting->triangles)
        counting->triangles[cell]++;
}

static struct counting count_pairs(const struct area_stage *stage, const struct area_model *model,
                                   enum area_extrusion extrusion, uint32_t *triangles)
{
    struct counting counting = {.model = model, .triangles = triangles};
    for (uint32_t i = 0; i < stage->triangle_count; i++)
        area_model_assign(model, &stage->triangles[i], extrusion, (struct area_margins){.place = 0},
                          count_cell, &counting);
    return counting;
}

struct needed { /* pairs of which the triangle hides some sample of the light */
    uint64_t of_points, of_cells;
};

/* Whether a plane through the point and an edge has the triangle on one side and all of the light
 * on the other. */
static bool is_beside(const struct area_triangle *t, const double point[3],
                      const double (*corners)[3])
{
    for (int k = 0; k < 3; k++) {
        double a[3], b[3], c[3], normal[3], to[3];
        bool is_apart = true;
        vec3_sub(t->at[(k + 1) % 3], point, a);
        vec3_sub(t->at[(k + 2) % 3], point, b);
        vec3_sub(t->at[k], point, c);
        vec3_cross(a, b, normal);
        for (int i = 0; i < 4 && is_apart; i++) {
            vec3_sub(corners[i], point, to);
            is_apart = vec3_dot(normal, to) * vec3_dot(normal, c) < 0;
        }
        if (is_apart)
            return true;
    }
    return false;
}

struct light_places { /* the samples of all pixels are the same */
    double corners[4][3], samples[SAMPLES][3];
};

/* By brute force, but for triangles beside. */
static bool hides_some(const struct area_triangle *t, const double point[3],
                       const struct light_places *light)
{
    if (is_beside(t, point, light->corners))
        return false;
    for (uint32_t s = 0; s < SAMPLES; s++)
        if (area_triangle_meet(t, point, light->samples[s]) == AREA_MEETS)
            return true;
    return false;
}

/* What no list has hides nothing, of which `gpu_area_grid` assures itself. */
static struct needed count_needed(const struct area_stage *stage, const struct area_answer *answer)
{
    struct needed needed = {0, 0};
    struct light_places light;
    const uint32_t count = answer->firsts[CELLS];
    uint8_t *is_needed = calloc(count + (size_t)1, 1); /* a pair of a cell and a triangle */
    assert_non_null(is_needed);
    for (int i = 0; i < 4; i++)
        rt_light_place(&stage->light, (const double[2]){i & 1, i >> 1}, light.corners[i]);
    for (uint32_t i = 0; i < SAMPLES; i++)
        area_stage_sample(stage, 0, i, light.samples[i]);
    for (uint32_t p = 0; p < stage->point_count; p++) {
        uint32_t cell = answer->places[p][0];
        for (uint32_t i = answer->firsts[cell]; i < answer->firsts[cell + 1]; i++) {
            if (!hides_some(&stage->triangles[answer->pairs[i]], stage->points[p], &light))
                continue;
            needed.of_points++;
            needed.of_cells += !is_needed[i];
            is_needed[i] = 1;
        }
    }
    free(is_needed);
    return needed;
}

/* Of cells with points, as table 8 has it. */
static void find_mean(const uint32_t *counts, const struct area_model *model, uint64_t *most,
                      double *mean)
{
    uint32_t used = 0;
    uint64_t sum = 0;
    *most = 0;
    for (uint32_t i = 0; i < model->side * model->side; i++) {
        used += model->cell_points[i] > 0;
        sum += counts[i];
        *most = counts[i] > *most ? counts[i] : *most;
    }
    *mean = (double)sum / used;
}

static double find_hull_excess(const struct area_stage *stage, const struct area_model *model)
{
    uint64_t boxed = 0, hulled = 0;
    for (uint32_t i = 0; i < stage->triangle_count; i++) {
        uint64_t in_box, in_hull;
        area_model_count_hull(model, &stage->triangles[i], &in_box, &in_hull);
        boxed += in_box;
        hulled += in_hull;
    }
    return (double)(boxed - hulled) / (double)hulled;
}

static struct area_light light_of(const struct area_stage *stage, double scale)
{
    struct state_light light = stage->light;
    for (int k = 0; k < 3; k++) {
        light.half_u[k] *= scale;
        light.half_v[k] *= scale;
    }
    return area_light_of(&light, 0, stage->samples, &(struct area_casters){.triangle_count = 0});
}

static void find_figures(const struct area_stage *stage, const struct area_model *model,
                         const struct needed *needed, struct figures *found)
{
    uint32_t *triangles = calloc(CELLS, sizeof *triangles);
    assert_non_null(triangles);
    struct counting corrected = count_pairs(stage, model, AREA_EXTRUDE_CELLS, triangles);
    struct counting far = count_pairs(stage, model, AREA_EXTRUDE_ALL, NULL);
    struct counting each = count_pairs(stage, model, AREA_EXTRUDE_CELL, NULL);
    find_mean(triangles, model, &found->triangles_most, &found->triangles_mean);
    find_mean(model->cell_points, model, &found->points_most, &found->points_mean);
    found->needed = (double)needed->of_points / (double)corrected.points;
    found->needed_by_cell = (double)needed->of_points / (double)each.points;
    found->saved =
        (double)(far.cells - corrected.cells) / (double)(corrected.cells - needed->of_cells);
    for (int i = 0; i < 2; i++) {
        struct area_model sized;
        const struct area_light light = light_of(stage, i ? 4 : 1);
        area_model_init(&sized, stage, &light, AREA_SIDE);
        found->hull_excess[i] = find_hull_excess(stage, &sized);
        area_model_finish(&sized);
    }
    free(triangles);
}

/* Table 4: a pane beside of all lines has the device ask planes. */
static void find_table_error(struct area_stage *stage, const struct area_answer *table,
                             struct figures *found)
{
    uint64_t sum = 0;
    const double beside[3][3] = {{90, 40, 90}, {91, 40, 90}, {90, 40, 91}};
    memcpy(area_stage_add(stage, 0.5)->at, beside, sizeof beside);
    struct area_answer planes = area_stage_must_ask(&rig, stage);
    found->table_most = 0;
    for (uint32_t p = 0; p < stage->point_count; p++) {
        uint32_t bits = 0;
        for (uint32_t s = p * SAMPLES; s < (p + 1) * SAMPLES; s++)
            bits += area_answer_filter(table->filters[s]) != area_answer_filter(planes.filters[s]);
        sum += bits;
        found->table_most = bits > found->table_most ? bits : found->table_most;
    }
    found->table_mean = (double)sum / stage->point_count;
    area_answer_finish(&planes);
}

static void tell(const struct figures *f)
{
    print_message(
        "  triangles of a cell: %llu, mean %.2f; points: %llu, mean %.3f\n"
        "  needed %.4f, by cells %.4f; hulls %.4f, %.4f; saved %.4f; table %u, mean %.4f\n",
        (unsigned long long)f->triangles_most, f->triangles_mean,
        (unsigned long long)f->points_most, f->points_mean, f->needed, f->needed_by_cell,
        f->hull_excess[0], f->hull_excess[1], f->saved, f->table_most, f->table_mean);
}

/* What f64 finds is the same on all machines, but for the last bits of the C library. Angles of the
 * table are the device's. */
static void expect_figures(const struct figures *found, const struct figures *f)
{
    assert_float_equal((double)found->triangles_most, (double)f->triangles_most, 1);
    assert_float_equal((double)found->points_most, (double)f->points_most, 1);
    assert_float_equal(found->triangles_mean, f->triangles_mean, 1e-2);
    assert_float_equal(found->points_mean, f->points_mean, 1e-3);
    assert_float_equal(found->needed, f->needed, 1e-4);
    assert_float_equal(found->needed_by_cell, f->needed_by_cell, 1e-4);
    for (int i = 0; i < 2; i++)
        assert_float_equal(found->hull_excess[i], f->hull_excess[i], 1e-4);
    assert_float_equal(found->saved, f->saved, 1e-3);
    assert_true(found->table_most > 0 && found->table_most <= f->table_most);
    assert_float_equal(found->table_mean, f->table_mean, 0.2 * f->table_mean);
}

static void grids_have_the_figures_of_the_definition(void **unused)
{
    (void)unused;
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        struct area_stage stage;
        struct area_model model;
        struct figures found = scenes[i];
        set_up(&stage, &scenes[i]);
        struct area_answer answer = area_stage_must_ask(&rig, &stage);
        area_model_init(&model, &stage, &answer.light, AREA_SIDE);
        print_message("%s: %u triangles, %u points\n", scenes[i].name, stage.triangle_count,
                      stage.point_count);
        compare_cells(&answer, &model);
        compare_lists(&stage, &answer, &model);
        struct needed needed = count_needed(&stage, &answer);
        find_figures(&stage, &model, &needed, &found);
        find_table_error(&stage, &answer, &found);
        tell(&found);
        expect_figures(&found, &scenes[i]);
        area_model_finish(&model);
        area_answer_finish(&answer);
        area_stage_finish(&stage);
    }
}

/* A triangle parallel to the light, over points of a plane parallel to both: what it hides is the
 * sum of two sets, the triangle extruded from one point and a rectangle like the light. Hull and
 * rectangle differ by as much as the triangle and its own rectangle do. */
static void one_triangle_has_the_hull_of_the_closed_form(void **unused)
{
    (void)unused;
    enum { SIDE = 700 };
    const double half = 0.5, far = 8, near = 5, ratio = far / near, lattice = 3;
    struct area_stage stage = {.point_count = SIDE * SIDE};
    const struct state_light light = {.type = SCENE_LIGHT_RECT,
                                      .direction = {0, 0, 1},
                                      .half_u = {half, 0, 0},
                                      .half_v = {0, half, 0},
                                      .area_m2 = 1};
    const struct area_triangle triangle = {
        .at = {{-0.9, -0.4, near}, {0.5, -0.7, near}, {0.2, 0.8, near}}};
    stage.light = light;
    stage.points = calloc(stage.point_count, sizeof *stage.points);
    assert_non_null(stage.points);
    for (int i = 0; i < SIDE * SIDE; i++) {
        stage.points[i][0] = lattice * (2 * (i % SIDE + 0.5) / SIDE - 1);
        stage.points[i][1] = lattice * (2 * (i / SIDE + 0.5) / SIDE - 1);
        stage.points[i][2] = far;
    }
    struct area_model model;
    const struct area_light source = light_of(&stage, 1);
    uint64_t boxed, hulled;
    area_model_init(&model, &stage, &source, AREA_SIDE);
    area_model_count_hull(&model, &triangle, &boxed, &hulled);
    const double wide = 1.4 * ratio, high = 1.5 * ratio, side = 2 * half * (ratio - 1);
    const double own = 0.5 * (1.4 * 1.2 + 1.1 * 0.3) * ratio * ratio;
    const double of_box = (wide + side) * (high + side);
    const double of_hull = own + side * (wide + high) + side * side;
    const double scale = SIDE * SIDE / (4 * lattice * lattice);
    print_message("%llu and %llu points, %.1f and %.1f\n", (unsigned long long)boxed,
                  (unsigned long long)hulled, of_box * scale, of_hull * scale);
    assert_float_equal((double)boxed / scale, of_box, 1e-2);
    assert_float_equal((double)hulled / scale, of_hull, 1e-2);
    area_model_finish(&model);
    area_stage_finish(&stage);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_triangle_has_the_hull_of_the_closed_form),
        cmocka_unit_test(grids_have_the_figures_of_the_definition),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}

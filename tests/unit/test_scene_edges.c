/* SPDX-License-Identifier: MIT */
/* Signed edge counts (closed form A13): integers, exact, for closed, open, many-fold and one-sided
 * meshes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "glb/shapes.h"
#include "renderer/scene/edge_table.h"
#include "tests/support/accuracy_log.h"

static struct edge_table table_of(const struct edge_mesh *mesh)
{
    struct edge_table table;
    struct error err = {0};
    if (!edge_table_init(&table, mesh, &err))
        fail_msg("%s", err.message);
    return table;
}

static bool closed(const struct edge_mesh *mesh)
{
    bool is_closed;
    struct error err = {0};
    if (!edge_mesh_is_closed(mesh, &is_closed, &err))
        fail_msg("%s", err.message);
    return is_closed;
}

static struct edge_mesh mesh_of(const struct shape *shape)
{
    assert_false(shape->is_out_of_memory);
    return (struct edge_mesh){.positions = shape->positions,
                              .vertex_count = (uint32_t)shape->vertex_count,
                              .indices = shape->indices,
                              .index_count = (uint32_t)shape->index_count};
}

static void expect_edges(const struct edge_mesh *mesh, uint32_t edges, uint32_t open)
{
    struct edge_table table = table_of(mesh);
    uint32_t found = 0;
    for (uint32_t i = 0; i < table.count; i++) {
        assert_true(table.records[i].low < table.records[i].high);
        assert_true((uint32_t)abs(table.records[i].signed_count) <= table.records[i].uses);
        found += table.records[i].signed_count != 0;
    }
    assert_int_equal(table.count, edges);
    assert_int_equal(found, open);
    edge_table_finish(&table);
}

static void closed_solids_cancel_on_every_edge(void **state)
{
    (void)state;
    struct shape box = {0}, ball = {0}, ring = {0};
    shape_add_box(&box, (double[]){-1, 0, 2}, (double[]){0.1, 0.7, 2.5});
    shape_add_sphere(&ball, (double[]){0.1, 0.2, 0.3}, 0.7, 24, 12);
    shape_add_torus(&ring, (double[]){0, 0, 0}, 1, 0.3, 32, 16);
    struct edge_mesh meshes[] = {mesh_of(&box), mesh_of(&ball), mesh_of(&ring)};
    expect_edges(&meshes[0], 18, 0);
    expect_edges(&meshes[1], 3 * 24 * (2 * 12 - 2) / 2, 0);
    expect_edges(&meshes[2], 3 * 32 * 16, 0);
    for (int i = 0; i < 3; i++)
        assert_true(closed(&meshes[i]));
    shape_finish(&box);
    shape_finish(&ball);
    shape_finish(&ring);
}

static void an_open_sheet_counts_its_border(void **state)
{
    (void)state;
    struct shape sheet = {0};
    shape_add_grid(&sheet, (double[]){0, 0, 0}, (double[]){1, 0, 0}, (double[]){0, 1, 0}, 7, 5);
    struct edge_mesh mesh = mesh_of(&sheet);
    expect_edges(&mesh, 7 * 6 + 8 * 5 + 7 * 5, 2 * (7 + 5));
    assert_false(closed(&mesh));
    shape_finish(&sheet);
}

/* k triangles around the edge from (0,0,0) to (0,0,1), the first `forward` of them along it. */
static void expect_fan(uint32_t k, uint32_t forward)
{
    float *positions = calloc(3 * (size_t)k + 6, sizeof *positions);
    uint32_t *indices = calloc(3 * (size_t)k + 1, sizeof *indices);
    assert_non_null(positions);
    assert_non_null(indices);
    positions[5] = 1;
    for (uint32_t i = 0; i < k; i++) {
        double angle = 6.283185307179586 * i / k;
        positions[3 * (i + 2)] = (float)cos(angle);
        positions[3 * (i + 2) + 1] = (float)sin(angle);
        indices[3 * i] = i < forward ? 0 : 1;
        indices[3 * i + 1] = i < forward ? 1 : 0;
        indices[3 * i + 2] = i + 2;
    }
    struct edge_mesh mesh = {positions, k + 2, indices, 3 * k, false};
    struct edge_table table = table_of(&mesh);
    assert_int_equal(table.count, k ? 2 * k + 1 : 0);
    if (k) {
        assert_int_equal(table.records[0].low, 0);
        assert_int_equal(table.records[0].high, 1);
        assert_int_equal(table.records[0].uses, k);
        assert_int_equal(table.records[0].signed_count, 2 * (int32_t)forward - (int32_t)k);
    }
    assert_false(closed(&mesh));
    edge_table_finish(&table);
    free(positions);
    free(indices);
}

static void an_edge_of_any_number_of_triangles_is_counted_exactly(void **state)
{
    (void)state;
    static const uint32_t folds[] = {0, 1, 2, 33, 128, 1000};
    for (size_t i = 0; i < sizeof folds / sizeof *folds; i++) {
        expect_fan(folds[i], 0);
        expect_fan(folds[i], folds[i] / 2);
        expect_fan(folds[i], folds[i]);
    }
}

/* The strip's cells are consistent with their neighbours but for the joint, where one side comes
 * back mirrored: that edge counts twice in one direction, and the border once each. */
static void a_moebius_strip_is_not_orientable(void **state)
{
    (void)state;
    enum { CELLS = 40 };
    float positions[2 * CELLS][3];
    uint32_t indices[CELLS][6];
    for (uint32_t i = 0; i < CELLS; i++) {
        double turn = 6.283185307179586 * i / CELLS;
        for (uint32_t side = 0; side < 2; side++) {
            double w = side ? 0.3 : -0.3, r = 1 + w * cos(turn / 2);
            positions[2 * i + side][0] = (float)(r * cos(turn));
            positions[2 * i + side][1] = (float)(w * sin(turn / 2));
            positions[2 * i + side][2] = (float)(r * sin(turn));
        }
        uint32_t a = 2 * i, b = a + 1, c = a + 2, d = a + 3;
        if (i == CELLS - 1) {
            c = 1;
            d = 0;
        }
        memcpy(indices[i], (uint32_t[]){a, b, c, c, b, d}, sizeof indices[i]);
    }
    struct edge_mesh mesh = {&positions[0][0], 2 * CELLS, &indices[0][0], 6 * CELLS, false};
    struct edge_table table = table_of(&mesh);
    uint32_t borders = 0, twisted = 0;
    for (uint32_t i = 0; i < table.count; i++) {
        borders += table.records[i].uses == 1;
        twisted += table.records[i].uses == 2 && abs(table.records[i].signed_count) == 2;
    }
    assert_int_equal(table.count, 4 * CELLS);
    assert_int_equal(borders, 2 * CELLS);
    assert_int_equal(twisted, 1);
    assert_false(closed(&mesh));
    edge_table_finish(&table);
}

static void negative_zero_and_zero_are_one_position(void **state)
{
    (void)state;
    static const float positions[][3] = {{0.0f, 0, 0},  {1, 0, 0},     {0, 1, 0},    {0, 0, 1},
                                         {-0.0f, 0, 0}, {1, -0.0f, 0}, {0, 1, -0.0f}};
    static const uint32_t indices[] = {4, 2, 1, 0, 5, 3, 0, 3, 6, 1, 2, 3};
    struct edge_mesh mesh = {&positions[0][0], 7, indices, 12, false};
    expect_edges(&mesh, 6, 0);
    assert_true(closed(&mesh));
}

static void nested_touching_and_crossing_shells_are_closed(void **state)
{
    (void)state;
    struct shape s = {0};
    double low[3] = {0, 0, 0};
    shape_add_box(&s, low, (double[]){1, 1, 1});
    shape_add_box(&s, (double[]){1, 0, 0}, (double[]){2, 1, 1}); /* shares a face */
    shape_add_box(&s, (double[]){0.2, 0.2, 0.2}, (double[]){0.4, 0.4, 0.4});
    shape_add_sphere(&s, (double[]){0.5, 0.5, 1}, 0.4, 16, 8);
    shape_add_box(&s, low, (double[]){1, 1, 1}); /* and one twice */
    struct edge_mesh mesh = mesh_of(&s);
    assert_true(closed(&mesh));
    /* a hollow: the inner box inside out, in the same mesh */
    for (size_t t = 24; t < 36; t++) {
        uint32_t kept = s.indices[3 * t];
        s.indices[3 * t] = s.indices[3 * t + 1];
        s.indices[3 * t + 1] = kept;
    }
    assert_true(closed(&mesh));
    shape_finish(&s);
}

static void every_single_fault_opens_a_mesh(void **state)
{
    (void)state;
    struct shape s = {0};
    shape_add_sphere(&s, (double[]){0, 0, 0}, 1, 12, 6);
    struct edge_mesh whole = mesh_of(&s), less = whole;
    assert_true(closed(&whole));
    less.index_count -= 3; /* a triangle is missing */
    assert_false(closed(&less));
    for (uint32_t t = 0; t < whole.index_count; t += 3) { /* or faces the other way */
        uint32_t kept = s.indices[t];
        s.indices[t] = s.indices[t + 1];
        s.indices[t + 1] = kept;
        assert_false(closed(&whole));
        s.indices[t + 1] = s.indices[t];
        s.indices[t] = kept;
    }
    float *y = &s.positions[3 * (size_t)s.indices[whole.index_count / 2] + 1], before = *y;
    *y = nextafterf(before, 2); /* or a corner is apart by one bit */
    assert_false(closed(&whole));
    *y = before;
    assert_true(closed(&whole));
    for (uint32_t t = 0; t < whole.index_count; t += 3) {
        uint32_t kept = s.indices[t];
        s.indices[t] = s.indices[t + 1];
        s.indices[t + 1] = kept;
    }
    assert_false(closed(&whole)); /* inside out as a whole */
    shape_finish(&s);
}

/* A tetrahedron with one edge split on one side only. */
static void a_t_junction_is_open(void **state)
{
    (void)state;
    static const float positions[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5f, 0, 0}};
    static const uint32_t split_once[] = {0, 2, 1, 0, 4, 3, 4, 1, 3, 0, 3, 2, 1, 2, 3};
    static const uint32_t split_twice[] = {0, 2, 4, 4, 2, 1, 0, 4, 3, 4, 1, 3, 0, 3, 2, 1, 2, 3};
    struct edge_mesh mesh = {&positions[0][0], 5, split_once, 15, false};
    expect_edges(&mesh, 6 + 3, 3);
    assert_false(closed(&mesh));
    mesh.indices = split_twice;
    mesh.index_count = 18;
    expect_edges(&mesh, 6 + 3, 0);
    assert_true(closed(&mesh));
}

/* Each edge of a tetrahedron with the two triangles that it lies between, a border with one. */
static void faces_are_those_on_either_side(void **state)
{
    (void)state;
    static const float positions[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const uint32_t indices[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    for (uint32_t triangles = 1; triangles <= 4; triangles++) {
        struct edge_mesh mesh = {&positions[0][0], 4, indices, 3 * triangles, true};
        struct edge_table table = table_of(&mesh);
        for (uint32_t e = 0; e < table.count; e++) {
            uint32_t found[2] = {UINT32_MAX, UINT32_MAX}, count = 0;
            for (uint32_t f = 0; f < triangles; f++) {
                bool has_low = false, has_high = false;
                for (uint32_t c = 0; c < 3; c++) {
                    has_low |= indices[3 * f + c] == table.records[e].low;
                    has_high |= indices[3 * f + c] == table.records[e].high;
                }
                if (has_low && has_high)
                    found[count++] = f;
            }
            assert_int_equal(table.records[e].uses, count);
            assert_memory_equal(table.faces[e], found, sizeof found);
        }
        edge_table_finish(&table);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faces_are_those_on_either_side),
        cmocka_unit_test(closed_solids_cancel_on_every_edge),
        cmocka_unit_test(an_open_sheet_counts_its_border),
        cmocka_unit_test(an_edge_of_any_number_of_triangles_is_counted_exactly),
        cmocka_unit_test(a_moebius_strip_is_not_orientable),
        cmocka_unit_test(negative_zero_and_zero_are_one_position),
        cmocka_unit_test(nested_touching_and_crossing_shells_are_closed),
        cmocka_unit_test(every_single_fault_opens_a_mesh),
        cmocka_unit_test(a_t_junction_is_open),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    accuracy_log(&(struct accuracy_result){
        .suite = "closed_forms",
        .scene = "A13 closed, open, 0 to 1000-fold, one-sided meshes",
        .technique = "edge counts",
        .metric = "of 8 claims about signed counts, those that fail",
        .error = failed,
        .tolerance = 0,
        .is_pass = failed == 0,
    });
    return failed;
}

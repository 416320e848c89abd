/* SPDX-License-Identifier: MIT */
/* Shapes: outward faces, unit normals, closed solids, and the areas and volumes they claim. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "glb/shapes.h"

static void position_of(const struct shape *shape, size_t corner, double p[3])
{
    for (size_t i = 0; i < 3; i++)
        p[i] = shape->positions[3 * shape->indices[corner] + i];
}

/* Twice the area vector of triangle t. */
static void area_vector(const struct shape *shape, size_t t, double n[3])
{
    double a[3], b[3], c[3];
    position_of(shape, 3 * t, a);
    position_of(shape, 3 * t + 1, b);
    position_of(shape, 3 * t + 2, c);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
    }
}

static double area_of(const struct shape *shape)
{
    double area = 0;
    for (size_t t = 0; t < shape->index_count / 3; t++) {
        double n[3];
        area_vector(shape, t, n);
        area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
    }
    return area;
}

/* By the divergence theorem: right only when the surface is closed and every face looks outward. */
static double volume_of(const struct shape *shape)
{
    double volume = 0;
    for (size_t t = 0; t < shape->index_count / 3; t++) {
        double n[3], p[3];
        area_vector(shape, t, n);
        position_of(shape, 3 * t, p);
        volume += (n[0] * p[0] + n[1] * p[1] + n[2] * p[2]) / 6;
    }
    return volume;
}

/* Whether area vectors cancel, as those of closed surfaces do. */
static bool is_closed(const struct shape *shape)
{
    double sum[3] = {0};
    for (size_t t = 0; t < shape->index_count / 3; t++) {
        double n[3];
        area_vector(shape, t, n);
        for (int i = 0; i < 3; i++)
            sum[i] += n[i];
    }
    return fabs(sum[0]) + fabs(sum[1]) + fabs(sum[2]) < 1e-4 * area_of(shape);
}

/* Normals are unit, and none points away from the face it belongs to. */
static void assert_normals_follow_faces(const struct shape *shape)
{
    for (size_t i = 0; i < shape->index_count; i++) {
        const float *n = shape->normals + 3 * shape->indices[i];
        double face[3];
        area_vector(shape, i / 3, face);
        assert_true(fabs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-5);
        assert_true(face[0] * n[0] + face[1] * n[1] + face[2] * n[2] > -1e-9);
    }
    for (size_t i = 0; i < shape->index_count; i++)
        assert_true(shape->indices[i] < shape->vertex_count);
}

static void assert_near(double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected)))
        fail_msg("%.9g is not within %g of %.9g", value, relative, expected);
}

/* Checks a solid and finishes it. */
static void assert_solid(struct shape *shape, double volume, double relative)
{
    assert_false(shape->is_out_of_memory);
    assert_normals_follow_faces(shape);
    assert_true(is_closed(shape));
    assert_near(volume_of(shape), volume, relative);
    shape_finish(shape);
}

static void boxes_and_round_solids_are_closed_and_face_outward(void **state)
{
    (void)state;
    static const double at[3] = {3, -2, 5};
    struct shape shape = {0};
    shape_add_box(&shape, (double[]){1, 2, 3}, (double[]){2, 4, 6});
    assert_solid(&shape, 6, 1e-6);
    shape_add_sphere(&shape, at, 0.5, 128, 96);
    assert_solid(&shape, 4 * M_PI / 3 * 0.125, 2e-3);
    shape_add_cylinder(&shape, at, 0.5, 2, 256);
    assert_solid(&shape, M_PI * 0.25 * 2, 1e-3);
    shape_add_cone(&shape, at, 0.5, 0, 2, 256);
    assert_solid(&shape, M_PI * 0.25 * 2 / 3, 1e-3);
    shape_add_cone(&shape, at, 0.5, 0.25, 1, 256);
    assert_solid(&shape, M_PI / 3 * (0.25 + 0.125 + 0.0625), 1e-3);
    shape_add_torus(&shape, at, 2, 0.5, 256, 64);
    assert_solid(&shape, 2 * M_PI * M_PI * 2 * 0.25, 2e-3);
}

static void outlined_solids_are_closed_and_face_outward(void **state)
{
    (void)state;
    struct shape shape = {0};
    struct shape_outline l_shape = {.points = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}},
                                    .count = 6};
    shape_add_extrusion(&shape, &l_shape, 0.5);
    assert_solid(&shape, 4 * 0.5, 1e-6);
    struct shape_outline hole;
    shape_outline_circle(&hole, 0.5, 1, 0.5, 240);
    shape_add_pierced_slab(&shape, (double[]){-1, 0}, (double[]){2, 2}, &hole, 0.25);
    assert_solid(&shape, (6 - M_PI * 0.25) * 0.25, 1e-3);
    shape_outline_arch(&hole, 1.2, 0.5, 2, 0.5, 200); /* round: 1.2 x 1.5 and half a disc */
    shape_add_pierced_slab(&shape, (double[]){-2, 0}, (double[]){2, 4}, &hole, 1);
    assert_solid(&shape, 16 - 1.2 * 1.5 - M_PI * 0.18, 1e-3);
    shape_add_arch(&shape, 1, 2, 3, 100);
    assert_solid(&shape, M_PI / 2 * 3 * 3, 1e-3);
}

static void a_place_moves_and_turns_without_mirroring(void **state)
{
    (void)state;
    struct shape shape = {0};
    shape_set_place(&shape, (double[]){10, 20, 30}, (double[]){0, 0, 1}, (double[]){0, 1, 0});
    shape_add_box(&shape, (double[]){0, 0, 0}, (double[]){1, 2, 3});
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t v = 0; v < shape.vertex_count; v++)
        for (size_t i = 0; i < 3; i++) {
            low[i] = fmin(low[i], shape.positions[3 * v + i]);
            high[i] = fmax(high[i], shape.positions[3 * v + i]);
        }
    assert_true(low[0] == 7 && low[1] == 20 && low[2] == 30);
    assert_true(high[0] == 10 && high[1] == 22 && high[2] == 31);
    assert_solid(&shape, 6, 1e-5);
}

static void faces_cover_their_outline_once(void **state)
{
    (void)state;
    struct shape shape = {0};
    struct shape_outline outline;
    shape_outline_circle(&outline, 3, 4, 2, 200);
    shape_add_face(&shape, &outline);
    assert_normals_follow_faces(&shape);
    assert_near(area_of(&shape), M_PI * 4, 1e-3);
    for (size_t v = 0; v < 2 * shape.vertex_count; v++)
        assert_true(shape.texcoords[v] >= 0 && shape.texcoords[v] <= 1);
    shape_finish(&shape);
    shape_outline_arch(&outline, 2, 0, 1, 0.5, 100);
    shape_add_face(&shape, &outline);
    assert_near(area_of(&shape), 2 + M_PI / 2, 1e-3);
    shape_finish(&shape);
    /* An equilateral arch of width 2: two triangles' worth of circular segments over the side. */
    shape_outline_arch(&outline, 2, 0, 1, 1, 200);
    shape_add_face(&shape, &outline);
    assert_near(area_of(&shape), 2 + 4 * M_PI / 3 - sqrt(3), 1e-3);
    shape_finish(&shape);
}

static void sheets_are_upright_and_cloth_hangs_to_its_hem(void **state)
{
    (void)state;
    struct shape shape = {0};
    shape_add_grid(&shape, (double[]){0, 0, 0}, (double[]){2, 0, 0}, (double[]){0, 3, 0}, 4, 5);
    assert_normals_follow_faces(&shape);
    assert_near(area_of(&shape), 6, 1e-6);
    assert_true(shape.texcoords[1] == 1); /* the corner is the lower left of the picture */
    assert_true(shape.normals[2] == 1);
    shape_finish(&shape);
    shape_add_curtain(
        &shape,
        &(struct shape_curtain_desc){
            .width = 2, .height = 3, .fold_depth = 0.1, .folds = 6, .columns = 96, .rows = 12});
    assert_true(area_of(&shape) > 6); /* folded cloth is more than its rectangle */
    double lowest = 0;
    for (size_t v = 0; v < shape.vertex_count; v++)
        lowest = fmin(lowest, shape.positions[3 * v + 1]);
    assert_true(lowest == -3);
    for (size_t i = 0; i < shape.index_count; i++) {
        const float *n = shape.normals + 3 * shape.indices[i];
        double face[3];
        area_vector(&shape, i / 3, face);
        assert_true(face[0] * n[0] + face[1] * n[1] + face[2] * n[2] > 0);
    }
    shape_finish(&shape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_and_round_solids_are_closed_and_face_outward),
        cmocka_unit_test(outlined_solids_are_closed_and_face_outward),
        cmocka_unit_test(a_place_moves_and_turns_without_mirroring),
        cmocka_unit_test(faces_cover_their_outline_once),
        cmocka_unit_test(sheets_are_upright_and_cloth_hangs_to_its_hem),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

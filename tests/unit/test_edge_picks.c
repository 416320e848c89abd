/* SPDX-License-Identifier: MIT */
/* Samples of edges against meshes whose edges are known, and what faces of volumes cover against
 * tiles that are counted by hand. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "renderer/base/matrix.h"
#include "renderer/cost/volume_cover.h"
#include "tests/support/import_support.h"

static const double PI = 3.14159265358979323846;

static void open_mesh(struct imported_scene *imported, struct glb_builder *builder, int mesh)
{
    struct error err = {0};
    struct scene_file file = {.name = "shape.glb"};
    void *glb = NULL;
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Shape", .mesh = mesh});
    if (!glb_builder_finish(builder, &glb, &file.size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    file.bytes = glb;
    if (!imported_scene_init(imported, &file, 1, &err))
        fail_msg("%s", err.message);
    free(glb);
}

static struct glb_builder *begin(int *material)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Shape", &err);
    assert_non_null(builder);
    *material = glb_builder_add_material(builder, &(struct glb_material_desc){.name = "Paint"});
    return builder;
}

static void open_shape(struct imported_scene *imported, struct shape *shape)
{
    int material;
    struct glb_builder *builder = begin(&material);
    open_mesh(imported, builder, shape_give_mesh(shape, builder, "Shape", material));
}

static void make(struct edge_picks *picks, const struct imported_scene *imported)
{
    struct error err = {0};
    if (!edge_picks_make(picks, &imported->scene, &err))
        fail_msg("%s", err.message);
}

static void place_of(const struct scene *scene, uint32_t vertex, double place[3])
{
    for (int k = 0; k < 3; k++)
        place[k] = (double)scene->positions[3 * (size_t)vertex + (size_t)k];
}

/* Whether one triangle of the edge faces the direction and the other does not. */
static bool is_outline(const struct scene *scene, const struct edge_pick *pick, const double to[3])
{
    double places[4][3], sides[2][3], normals[2][3];
    if (pick->vertices[3] == EDGE_IS_BORDER)
        return true;
    for (int i = 0; i < 4; i++)
        place_of(scene, pick->vertices[i], places[i]);
    for (int i = 0; i < 2; i++) {
        vec3_sub(places[!i], places[i], sides[0]);
        vec3_sub(places[2 + i], places[i], sides[1]);
        vec3_cross(sides[0], sides[1], normals[i]);
    }
    return (vec3_dot(normals[0], to) > 0) != (vec3_dot(normals[1], to) > 0);
}

static double length_of(const struct scene *scene, const struct edge_pick *pick)
{
    double ends[2][3], along[3];
    place_of(scene, pick->vertices[0], ends[0]);
    place_of(scene, pick->vertices[1], ends[1]);
    vec3_sub(ends[1], ends[0], along);
    return vec3_length(along);
}

/* Of all picks or of those of an outline; at least so long. */
static double count(const struct imported_scene *imported, const struct edge_picks *picks,
                    const double *to, double least_m)
{
    double sum = 0;
    for (size_t i = 0; i < picks->count; i++)
        if ((!to || is_outline(&imported->scene, &picks->picks[i], to)) &&
            length_of(&imported->scene, &picks->picks[i]) >= least_m)
            sum += (double)picks->picks[i].weight;
    return sum;
}

/* Its corners have a vertex for each side. */
static void a_box_has_eighteen_edges_six_of_its_outline(void **unused)
{
    (void)unused;
    struct shape shape = {0};
    struct imported_scene imported = {0};
    struct edge_picks picks = {0};
    shape_add_box(&shape, (double[]){0, 0, 0}, (double[]){1, 2, 3});
    open_shape(&imported, &shape);
    make(&picks, &imported);
    assert_int_equal(picks.count, 18);
    assert_true(count(&imported, &picks, NULL, 0) == 18);
    assert_true(count(&imported, &picks, (double[]){0.3, 0.5, 0.9}, 0) == 6);
    assert_true(count(&imported, &picks, (double[]){1, 0, 0}, 0) == 4);
    edge_picks_finish(&picks);
    imported_scene_finish(&imported);
}

static void a_sheet_has_a_border(void **unused)
{
    (void)unused;
    struct shape shape = {0};
    struct imported_scene imported = {0};
    struct edge_picks picks = {0};
    shape_add_grid(&shape, (double[]){0, 0, 0}, (double[]){1, 0, 0}, (double[]){0, 1, 0}, 4, 4);
    open_shape(&imported, &shape);
    make(&picks, &imported);
    assert_true(count(&imported, &picks, NULL, 0) == 56); /* 40 sides and 16 diagonals */
    assert_true(count(&imported, &picks, (double[]){0, 0, 1}, 0) == 16);
    edge_picks_finish(&picks);
    imported_scene_finish(&imported);
}

enum { COLUMNS = 40, SIDES = 96 };

/* Columns with balls: of 325,440 edges 7680 are as long as a column, and 80 are of the outlines of
 * columns that light from the side shines on. */
static void open_columns(struct imported_scene *imported)
{
    struct shape shape = {0};
    for (int i = 0; i < COLUMNS; i++) {
        const int row = i / 8, column = i % 8;
        double x = 2. * column, z = 2. * row;
        shape_add_cylinder(&shape, (double[]){x, 0, z}, 0.25, 3.5, SIDES);
        shape_add_sphere(&shape, (double[]){x, 4.2, z}, 0.4, 72, 36);
    }
    open_shape(imported, &shape);
}

static void few_long_edges_among_many_short_ones_are_counted(void **unused)
{
    (void)unused;
    struct imported_scene imported = {0};
    struct edge_picks picks = {0};
    open_columns(&imported);
    make(&picks, &imported);
    double triangles = imported.scene.primitives[0].index_count / 3.0;
    double all = count(&imported, &picks, NULL, 0), tall = count(&imported, &picks, NULL, 3.4);
    double outlines = 0, near = 1.5 * triangles;
    enum { DIRECTIONS = 64 };
    for (int i = 0; i < DIRECTIONS; i++) {
        double angle = 2 * PI * (i + 0.37) / DIRECTIONS;
        outlines += count(&imported, &picks, (double[]){cos(angle), 0, sin(angle)}, 3.4);
    }
    printf("%g triangles, %zu picks: %g edges, %g tall, %g of outlines\n", triangles, picks.count,
           all, tall, outlines / DIRECTIONS);
    assert_true(picks.count > 1000 && (double)picks.count < 0.5 * near);
    assert_true(fabs(all - near) < 0.05 * near);
    assert_true(fabs(tall - 2. * SIDES * COLUMNS) < 0.15 * 2 * SIDES * COLUMNS);
    assert_true(fabs(outlines / DIRECTIONS - 2. * COLUMNS) < 0.2 * 2 * COLUMNS);
    edge_picks_finish(&picks);
    imported_scene_finish(&imported);
}

/* Triangles of their own, so far apart; 0: all at one place. */
static void open_soup(struct imported_scene *imported, int triangle_count, float apart)
{
    int material;
    struct glb_builder *builder = begin(&material);
    float(*triangles)[9] = calloc((size_t)triangle_count, sizeof *triangles);
    assert_non_null(triangles);
    for (int i = 0; i < triangle_count; i++) {
        const float x = apart * (float)i;
        const float corners[9] = {x, 0, 0, x + 0.0625f, 0, 0, x, 0.0625f, 0};
        memcpy(triangles[i], corners, sizeof corners);
    }
    const struct glb_primitive_desc primitive = {.material = material,
                                                 .vertex_count = 3 * (size_t)triangle_count,
                                                 .positions = triangles[0]};
    open_mesh(imported, builder, glb_builder_add_mesh(builder, "Soup", &primitive, 1));
    free(triangles);
}

static void triangles_apart_have_borders_alone(void **unused)
{
    (void)unused;
    struct imported_scene imported = {0};
    struct edge_picks picks = {0};
    open_soup(&imported, 70000, 0.125f); /* more than are looked at */
    make(&picks, &imported);
    assert_true(picks.count > 0);
    for (size_t i = 0; i < picks.count; i++)
        assert_true(picks.picks[i].vertices[3] == EDGE_IS_BORDER);
    assert_true(fabs(count(&imported, &picks, NULL, 0) - 210000) < 2100);
    edge_picks_finish(&picks);
    imported_scene_finish(&imported);
}

/* Where looking for them would take the square of their number. */
static void edges_at_one_place_are_left_out_beyond_some(void **unused)
{
    (void)unused;
    struct imported_scene imported = {0};
    struct edge_picks picks = {0};
    open_soup(&imported, 65000, 0); /* all are looked at */
    make(&picks, &imported);
    double found = count(&imported, &picks, NULL, 0);
    assert_true(found > 0 && found < 1000);
    edge_picks_finish(&picks);
    imported_scene_finish(&imported);
}

static void the_same_scene_has_the_same_picks(void **unused)
{
    (void)unused;
    struct imported_scene imported = {0};
    struct edge_picks picks[2] = {{.lists = NULL}};
    open_columns(&imported);
    make(&picks[0], &imported);
    const struct edge_pick *kept = picks[0].picks;
    make(&picks[0], &imported);
    assert_ptr_equal(kept, picks[0].picks);
    make(&picks[1], &imported);
    assert_int_equal(picks[0].count, picks[1].count);
    for (size_t i = 0; i < picks[0].count; i++) {
        const struct edge_pick *a = &picks[0].picks[i], *b = &picks[1].picks[i];
        assert_memory_equal(a->vertices, b->vertices, sizeof a->vertices);
        assert_true(a->weight == b->weight && a->turns == b->turns && a->lengths == b->lengths);
    }
    edge_picks_finish(&picks[0]);
    edge_picks_finish(&picks[1]);
    imported_scene_finish(&imported);
}

static void steps_meet_each_size_by_its_share(void **unused)
{
    (void)unused;
    const double sizes[] = {0.5, 30, 0, 2.5, 7, 0.01, 60};
    double sum = 0, hits = 0;
    struct size_steps steps = size_steps_begin(100.01, 50);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        double met = size_steps_count(&steps, sizes[i]);
        assert_true(fabs(met - sizes[i] / steps.step) < 1);
        sum += sizes[i];
        hits += met;
    }
    assert_true(hits == 50 && fabs(sum - 100.01) < 1e-9);
}

/* From above, 25 pixels a metre, before a wall in depth 5. */
static struct volume_cover cover_before(const struct camera *camera, double wall)
{
    struct volume_cover cover = {.camera = camera, .width_px = 104, .height_px = 104};
    for (int row = 0; row < SCENE_ROWS; row++)
        for (int column = 0; column < SCENE_COLUMNS; column++)
            cover.ends[row][column] = wall;
    return cover;
}

static void faces_cover_tiles_with_something_behind(void **unused)
{
    (void)unused;
    const struct camera camera = {.eye = {0, 0, 5},
                                  .right = {1, 0, 0},
                                  .up = {0, 1, 0},
                                  .back = {0, 0, 1},
                                  .is_orthographic = true,
                                  .half_width = 2.08,
                                  .half_height = 2.08,
                                  .z_far = 10};
    const struct state_light sun = {.type = SCENE_LIGHT_DIRECTIONAL, .direction = {1, 0, -1}};
    const double ends[2][3] = {{-1, -0.5, 1}, {-1, 0.5, 1}};
    struct volume_outline side = volume_outline_of_side(&camera, &sun, ends);
    struct volume_cover open = cover_before(&camera, 5), closed = cover_before(&camera, 3.9);
    /* columns from 27 to 104 px are tiles 3 to 12; rows from 39.5 to 64.5 px are tiles 4 to 8 */
    assert_true(fabs(volume_cover_measure(&open, &side) - 10. * 5 * 64) < 1e-6);
    assert_true(fabs(volume_cover_most(&open, &side) - 10. * 5 * 64) < 1e-6);
    assert_true(volume_cover_measure(&closed, &side) == 0);
    struct volume_outline small = volume_outline_of_triangle(
        &camera, (double[]){0, 0, 1}, (double[]){0.2, 0, 1}, (double[]){0, 0.16, 1});
    assert_true(volume_cover_measure(&open, &small) == 5 * 4);
    assert_true(volume_cover_measure(&closed, &small) == 0);
    struct volume_outline beside = volume_outline_of_triangle(
        &camera, (double[]){9, 0, 1}, (double[]){9.2, 0, 1}, (double[]){9, 0.2, 1});
    assert_true(volume_cover_measure(&open, &beside) == 0);
}

/* A side that begins before the eye and goes on behind it, of a light behind what is seen. */
static void faces_are_cut_at_the_eye(void **unused)
{
    (void)unused;
    const struct camera camera = {.right = {1, 0, 0},
                                  .up = {0, 1, 0},
                                  .back = {0, 0, 1},
                                  .half_width = 1,
                                  .half_height = 1,
                                  .z_near = 0.01};
    const struct state_light lamp = {.type = SCENE_LIGHT_POINT, .position = {0, 0, -9}};
    const double ends[2][3] = {{0.5, -9, -4}, {0.5, 9, -4}};
    struct volume_cover cover = cover_before(&camera, 5);
    struct volume_outline side = volume_outline_of_side(&camera, &lamp, ends);
    /* from x = 0.5 / 4 of the half picture at all heights to its right edge: 58 to 104 px */
    assert_true(fabs(volume_cover_measure(&cover, &side) - 6. * 13 * 64) < 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_box_has_eighteen_edges_six_of_its_outline),
        cmocka_unit_test(a_sheet_has_a_border),
        cmocka_unit_test(few_long_edges_among_many_short_ones_are_counted),
        cmocka_unit_test(triangles_apart_have_borders_alone),
        cmocka_unit_test(edges_at_one_place_are_left_out_beyond_some),
        cmocka_unit_test(the_same_scene_has_the_same_picks),
        cmocka_unit_test(steps_meet_each_size_by_its_share),
        cmocka_unit_test(faces_cover_tiles_with_something_behind),
        cmocka_unit_test(faces_are_cut_at_the_eye),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

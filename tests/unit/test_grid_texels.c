/* SPDX-License-Identifier: MIT */
/* Density grids as shaders read them: every cell finds its voxels in one brick, and empty bricks
 * take no room. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/scene/grid_texels.h"
#include "shaders/shared/layout.h"
#include "tests/support/import_support.h"

#include "shaders/shared/records.h"

struct box {
    uint32_t size[3];
    const float *values;
};

static struct imported_scene make(const struct box *boxes, int count)
{
    struct imported_scene imported;
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("grids", &err);
    struct scene_file file = {.name = ""};
    void *glb;
    assert_non_null(builder);
    for (int i = 0; i < count; i++) {
        struct glb_grid_desc desc = {.name = "Grid",
                                     .values = boxes[i].values,
                                     .density = 1,
                                     .high = {1, 1, 1},
                                     .color = {1, 1, 1},
                                     .extinction = {1, 1, 1}};
        memcpy(desc.size, boxes[i].size, sizeof desc.size);
        int grid = glb_builder_add_grid(builder, &desc);
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Grid", .grid = grid});
    }
    if (!glb_builder_finish(builder, &glb, &file.size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    file.bytes = glb;
    if (!imported_scene_init(&imported, &file, 1, &err))
        fail_msg("%s", err.message);
    free(glb);
    return imported;
}

/* The pair that begins at a voxel, as density_grids.glsl finds it. */
static void read_pair(const struct grid_texels *texels, const struct scene *scene, uint32_t grid,
                      const uint32_t cell[3], uint32_t up_y, uint32_t up_z, float pair[2])
{
    uint32_t along[3];
    for (int k = 0; k < 3; k++)
        along[k] = scene->grids[grid].size[k] > 1 ? (scene->grids[grid].size[k] + 6) / 8 : 1;
    uint32_t at = texels->first_brick[grid] + cell[0] / 8 +
                  along[0] * (cell[1] / 8 + along[1] * (cell[2] / 8));
    uint32_t values = texels->bricks[at];
    pair[0] = pair[1] = 0;
    if (values)
        memcpy(pair,
               texels->pairs[values - 1]
                            [cell[0] % 8 + 8 * (cell[1] % 8 + up_y + 9 * (cell[2] % 8 + up_z))],
               2 * sizeof *pair);
}

static void expect_cells(const struct grid_texels *texels, const struct scene *scene, uint32_t grid)
{
    const struct density_grid values = density_grid_of(scene, &scene->grids[grid]);
    uint32_t cells[3], cell[3];
    for (int k = 0; k < 3; k++)
        cells[k] = values.size[k] > 1 ? values.size[k] - 1 : 1;
    for (cell[2] = 0; cell[2] < cells[2]; cell[2]++)
        for (cell[1] = 0; cell[1] < cells[1]; cell[1]++)
            for (cell[0] = 0; cell[0] < cells[0]; cell[0]++)
                for (uint32_t up = 0; up < 4; up++) {
                    float pair[2];
                    int64_t y = cell[1] + (up & 1), z = cell[2] + (up >> 1);
                    read_pair(texels, scene, grid, cell, up & 1, up >> 1, pair);
                    assert_true(pair[0] == density_grid_voxel(&values, cell[0], y, z));
                    assert_true(pair[1] == density_grid_voxel(&values, cell[0] + 1, y, z));
                }
}

static void every_cell_finds_its_voxels_in_one_brick(void **state)
{
    (void)state;
    enum { COUNT = 26 * 9 * 17 };
    static float values[COUNT];
    static const float one[1] = {2};
    struct grid_texels texels;
    struct error err = {0};
    for (size_t i = 0; i < COUNT; i++)
        values[i] = i % 26 == 8 || i % 26 > 22 ? (float)(1 + i) : 0;
    const struct box boxes[3] = {{{1, 1, 1}, one}, {{26, 9, 17}, values}, {{9, 26, 17}, values}};
    struct imported_scene imported = make(boxes, 3);
    assert_true(grid_texels_init(&texels, &imported.scene, &err));
    assert_int_equal(texels.first_brick[1], 1);
    assert_int_equal(texels.first_brick[2], 1 + 4 * 1 * 2);
    assert_int_equal(texels.brick_count, 1 + 8 + 1 * 4 * 2);
    for (uint32_t grid = 0; grid < 3; grid++)
        expect_cells(&texels, &imported.scene, grid);
    grid_texels_finish(&texels);
    imported_scene_finish(&imported);
}

static void empty_bricks_take_no_room(void **state)
{
    (void)state;
    enum { SIDE = 40 };
    static float values[SIDE * SIDE * SIDE];
    struct grid_texels texels;
    struct error err = {0};
    values[12 + SIDE * (12 + SIDE * 12)] = 1; /* inside a brick */
    const struct box box = {{SIDE, SIDE, SIDE}, values};
    struct imported_scene imported = make(&box, 1);
    assert_true(grid_texels_init(&texels, &imported.scene, &err));
    assert_int_equal(texels.brick_count, 125);
    assert_int_equal(texels.filled_count, 1);
    grid_texels_finish(&texels);
    imported_scene_finish(&imported);
}

/* A voxel at the corner of eight bricks is in all of them. */
static void a_voxel_between_bricks_is_in_all_of_them(void **state)
{
    (void)state;
    enum { SIDE = 40 };
    static float values[SIDE * SIDE * SIDE];
    struct grid_texels texels;
    struct error err = {0};
    values[16 + SIDE * (16 + SIDE * 16)] = 1;
    const struct box box = {{SIDE, SIDE, SIDE}, values};
    struct imported_scene imported = make(&box, 1);
    assert_true(grid_texels_init(&texels, &imported.scene, &err));
    assert_int_equal(texels.filled_count, 8);
    expect_cells(&texels, &imported.scene, 0);
    grid_texels_finish(&texels);
    imported_scene_finish(&imported);
}

/* Nine grids, or long ones, are for rays. */
static void more_grids_than_fit_are_told(void **state)
{
    (void)state;
    static float values[4095];
    values[7] = 1;
    const struct box small = {{1, 1, 1}, values + 7}, large = {{4095, 1, 1}, values};
    const struct box many[9] = {small, small, small, small, small, small, small, small, small};
    const struct box longest[2] = {large, small};
    const struct view view = {.width_px = 1};
    const struct {
        const struct box *boxes;
        int count;
        const char *why;
    } cases[4] = {
        {many, 8, NULL}, {many, 9, "8 density grids"}, {&small, 1, NULL}, {longest, 2, "sides"}};
    for (int i = 0; i < 4; i++) {
        struct imported_scene imported = make(cases[i].boxes, cases[i].count);
        struct scene_state scene_state = {0};
        struct error err = {0};
        assert_true(scene_state_init(&scene_state, &imported.scene, &view, &err));
        const char *excess = grid_texels_excess(&scene_state);
        assert_int_equal(excess != NULL, cases[i].why != NULL);
        assert_true(!excess || strstr(excess, cases[i].why));
        scene_state_finish(&scene_state);
        imported_scene_finish(&imported);
    }
}

static void shaders_have_the_same_sizes(void **state)
{
    (void)state;
    assert_int_equal(GRID_BRICK_PAIRS, GRID_BRICK_TEXELS);
    assert_int_equal(sizeof(struct grid_record), 16 * GRID_RECORD_TEXELS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_cell_finds_its_voxels_in_one_brick),
        cmocka_unit_test(empty_bricks_take_no_room),
        cmocka_unit_test(a_voxel_between_bricks_is_in_all_of_them),
        cmocka_unit_test(more_grids_than_fit_are_told),
        cmocka_unit_test(shaders_have_the_same_sizes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* Where depths of density grids are kept: how fine, and for which pictures. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/smoke_lattice.h"

enum { BRICKS = 2 };

/* A box of 2 x 1 x 1 m, 3 m before the eye, in two bricks; a second one like it. */
struct stage {
    struct scene_grid_brick bricks[BRICKS];
    struct state_grid grids[2];
    struct state_light lights[3];
    struct scene_state state;
    struct camera camera;
    struct view view;
};

static void fill_grid(struct stage *stage, struct state_grid *grid)
{
    const uint32_t size[3] = {16, 8, 8};
    memcpy(grid->values.size, size, sizeof size);
    memcpy(grid->values.bricks_along, (const uint32_t[]){2, 1, 1}, 3 * sizeof(uint32_t));
    grid->values.bricks = stage->bricks;
    mat4_identity(grid->world_from_voxel);
    for (int k = 0; k < 3; k++) {
        grid->world_from_voxel[5 * k] = 1.0 / 8;
        grid->world_from_voxel[12 + k] = k == 2 ? -4 : -0.5 * size[k] / 8;
        grid->sigma[k] = 1 + k;
    }
}

static void set_up(struct stage *stage)
{
    *stage = (struct stage){
        .bricks = {{.values = 1, .largest = 1}, {.values = 2, .largest = 1}},
        .camera = {.right = {1, 0, 0},
                   .up = {0, 1, 0},
                   .back = {0, 0, 1},
                   .half_width = 0.3,
                   .half_height = 0.2,
                   .z_near = 0.1},
        .view = {.width_px = 1280, .height_px = 720, .quality = {.shadows = SHADOWS_DEEP}},
    };
    for (int i = 0; i < 2; i++)
        fill_grid(stage, &stage->grids[i]);
    stage->lights[1].casts_shadow = true;
    stage->state.grids = stage->grids;
    stage->state.grid_count = 1;
    stage->state.lights = stage->lights;
    stage->state.light_count = 3;
}

static bool serves(const struct stage *stage)
{
    return smoke_lattice_serves(&stage->view, &stage->state, &stage->camera, UINT64_MAX);
}

static void steps_are_halves_of_voxels_and_no_longer_than_a_share_of_the_box(void **state)
{
    (void)state;
    struct stage stage;
    uint32_t steps[3];
    set_up(&stage);
    smoke_lattice_steps(&stage.grids[0], steps);
    assert_memory_equal(steps, ((const uint32_t[]){64, 32, 32}), sizeof steps);
    stage.grids[0].values.size[1] = 60; /* of as many voxels of an eighth of a metre */
    smoke_lattice_steps(&stage.grids[0], steps);
    assert_memory_equal(steps, ((const uint32_t[]){32, 120, 16}), sizeof steps);
}

static void colours_have_depths_of_their_own_where_grids_differ(void **state)
{
    (void)state;
    struct stage stage;
    set_up(&stage);
    stage.state.grid_count = 2;
    for (int k = 0; k < 3; k++)
        stage.grids[1].sigma[k] *= 0.3;
    assert_int_equal(smoke_lattice_of(&stage.state).channels, 1);
    assert_int_equal(smoke_lattice_of(&stage.state).points, 2 * 65 * 33 * 33);
    assert_int_equal(smoke_lattice_bytes(&stage.state), (uint64_t)2 * 65 * 33 * 33 * 3 * 4);
    stage.grids[1].sigma[1] *= 1.1;
    assert_int_equal(smoke_lattice_of(&stage.state).channels, 3);
}

static void they_are_kept_for_pictures_with_as_many_nodes_in_smoke(void **state)
{
    (void)state;
    struct stage stage;
    set_up(&stage);
    assert_true(serves(&stage));
    assert_false(smoke_lattice_serves(&stage.view, &stage.state, &stage.camera,
                                      smoke_lattice_bytes(&stage.state) - 1));
    stage.camera.eye[2] = 40; /* the box is small in the picture */
    assert_false(serves(&stage));
    assert_true(smoke_lattice_serves(&stage.view, &stage.state, NULL, UINT64_MAX));
    stage.camera.eye[2] = -3.5; /* in the smoke */
    assert_true(serves(&stage));
    stage.camera.eye[2] = -10; /* behind the eye */
    assert_false(serves(&stage));
    set_up(&stage);
    stage.view.width_px = 32; /* few columns */
    stage.view.height_px = 18;
    assert_false(serves(&stage));
}

static void they_are_kept_for_nothing_that_does_not_need_them(void **state)
{
    (void)state;
    struct stage stage;
    set_up(&stage);
    stage.bricks[0].values = stage.bricks[1].values = 0;
    assert_false(serves(&stage));
    set_up(&stage);
    stage.view.quality.shadows = SHADOWS_NONE;
    assert_false(serves(&stage));
    set_up(&stage);
    stage.lights[1].casts_shadow = false;
    assert_false(serves(&stage));
    set_up(&stage);
    stage.state.grid_count = 0;
    assert_false(serves(&stage));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_are_halves_of_voxels_and_no_longer_than_a_share_of_the_box),
        cmocka_unit_test(colours_have_depths_of_their_own_where_grids_differ),
        cmocka_unit_test(they_are_kept_for_pictures_with_as_many_nodes_in_smoke),
        cmocka_unit_test(they_are_kept_for_nothing_that_does_not_need_them),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

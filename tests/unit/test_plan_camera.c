/* SPDX-License-Identifier: MIT */
/* Fitted cameras: the whole bounding box is in the image, and fills it in one direction. Cameras of
 * the file: all that they show is in the image. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/camera.h"
#include "tests/support/light_scene.h"

enum { SIDES = 8 };

/* A state with nothing but bounds: a camera that fits asks for no more. */
static struct scene_state boxed(uint64_t *seed, const struct scene *scene)
{
    struct scene_state state = {.scene = scene, .unit_m = 1};
    for (int k = 0; k < 3; k++) {
        double middle = random_uniform(seed, -1e3, 1e3), half = random_uniform(seed, 0.01, 50);
        state.bounds_min[k] = middle - half;
        state.bounds_max[k] = middle + half;
    }
    return state;
}

/* The greatest |x| and |y| of the corners in units of the image's half sides. */
static double fill_of(const struct camera *camera, const struct scene_state *state)
{
    double fill = 0;
    for (int corner = 0; corner < 8; corner++) {
        double world[3], view[3];
        for (int k = 0; k < 3; k++)
            world[k] = corner >> k & 1 ? state->bounds_max[k] : state->bounds_min[k];
        camera_to_view(camera, world, view);
        assert_true(view[2] > 0);
        double w = camera->is_orthographic ? 1 : view[2];
        fill = fmax(fill, fmax(fabs(view[0]) / (w * camera->half_width),
                               fabs(view[1]) / (w * camera->half_height)));
    }
    return fill;
}

static void a_fitted_box_fills_the_image_from_every_side(void **unused)
{
    (void)unused;
    const struct scene scene = {.header = NULL};
    uint64_t seed = 5;
    for (int trial = 0; trial < 700; trial++) {
        struct scene_state state = boxed(&seed, &scene);
        struct view view = {.width_px = 16 + 100 * (trial % 5), .height_px = 200};
        view.camera = (struct view_camera){.kind = VIEW_CAMERA_FIT,
                                           .fit = (enum view_fit)(trial % SIDES),
                                           .is_orthographic = trial / SIDES & 1,
                                           .fov_y_deg = trial % 3 ? 0 : 20};
        struct camera camera;
        struct error err = {0};
        if (!camera_resolve(&camera, &view, &state, &err))
            fail_msg("%s", err.message);
        assert_int_equal(camera.is_orthographic, trial / SIDES & 1);
        double fill = fill_of(&camera, &state);
        double most = view.camera.fit == VIEW_FIT_THREE_QUARTER ? 1 / 1.1 : 1;
        assert_true(fill <= most + 1e-9 && fill > most - 0.05);
    }
}

/* 35 degrees to the right of the front, 20 above it, and not as wide as other cameras. */
static void a_three_quarter_view_is_that_of_a_photographer(void **unused)
{
    (void)unused;
    const struct scene scene = {.header = NULL};
    uint64_t seed = 11;
    struct scene_state state = boxed(&seed, &scene);
    struct view view = {.width_px = 64,
                        .height_px = 64,
                        .camera = {.kind = VIEW_CAMERA_FIT, .fit = VIEW_FIT_THREE_QUARTER}};
    struct camera camera;
    struct error err = {0};
    assert_true(camera_resolve(&camera, &view, &state, &err));
    const double degree = acos(-1) / 180;
    assert_true(fabs(asin(camera.back[1]) / degree - 20) < 0.05);
    assert_true(fabs(atan2(camera.back[0], camera.back[2]) / degree - 35) < 0.05);
    assert_true(fabs(atan(camera.half_height) / degree - 15) < 1e-9);
    view.camera.fov_y_deg = 60;
    assert_true(camera_resolve(&camera, &view, &state, &err));
    assert_true(fabs(atan(camera.half_height) / degree - 30) < 1e-9);
}

static void each_side_looks_along_its_axis(void **unused)
{
    (void)unused;
    static const double back[SIDES][3] = {{0, 0, 1},  {0, 1, 0},  {1, 0, 0},  {0, 0, 0},
                                          {0, 0, -1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 0}};
    const struct scene scene = {.header = NULL};
    uint64_t seed = 9;
    struct scene_state state = boxed(&seed, &scene);
    for (int side = 0; side < SIDES; side++) {
        struct view view = {.width_px = 64, .height_px = 64};
        view.camera = (struct view_camera){.kind = VIEW_CAMERA_FIT, .fit = (enum view_fit)side};
        struct camera camera;
        struct error err = {0};
        assert_true(camera_resolve(&camera, &view, &state, &err));
        if (side != VIEW_FIT_ISO && side != VIEW_FIT_THREE_QUARTER)
            assert_true(vec3_dot(camera.back, back[side]) == 1);
    }
}

static void an_empty_scene_is_fitted_too(void **unused)
{
    (void)unused;
    const struct scene scene = {.header = NULL};
    struct scene_state state = {
        .scene = &scene, .unit_m = 1, .bounds_min = {1, 1, 1}, .bounds_max = {-1, -1, -1}};
    for (int is_orthographic = 0; is_orthographic < 2; is_orthographic++) {
        struct view view = {.width_px = 64, .height_px = 48};
        view.camera =
            (struct view_camera){.kind = VIEW_CAMERA_FIT, .is_orthographic = is_orthographic};
        struct camera camera;
        struct error err = {0};
        assert_true(camera_resolve(&camera, &view, &state, &err));
        assert_true(isfinite(camera.eye[2]) && camera.eye[2] > 1 && camera.half_height > 0);
    }
}

/* Half the width and height of what a camera of the file shows, 1 m before it, in an image. */
static void look_through(const struct scene_camera *file, double fov_y_deg, int width_px,
                         int height_px, double half[2])
{
    const struct scene_node node = {.mesh = -1, .light = -1, .camera = 0};
    const struct scene_header header = {.default_camera_node = 0};
    const struct scene scene = {
        .header = &header, .nodes = &node, .node_count = 1, .cameras = file, .camera_count = 1};
    double world[1][16] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    struct scene_state state = {.scene = &scene, .world = world, .unit_m = 1};
    const struct view view = {
        .width_px = width_px, .height_px = height_px, .camera = {.fov_y_deg = fov_y_deg}};
    struct camera camera;
    struct error err = {0};
    if (!camera_resolve(&camera, &view, &state, &err))
        fail_msg("%s", err.message);
    assert_int_equal(camera.is_orthographic, file->is_orthographic && fov_y_deg == 0);
    assert_float_equal(camera.half_width * height_px, camera.half_height * width_px, 1e-9);
    half[0] = camera.half_width;
    half[1] = camera.half_height;
}

/* The file's frame touches the image's edge in the direction in which the image has less. */
static void an_image_holds_all_that_a_camera_of_the_file_shows(void **unused)
{
    (void)unused;
    const struct scene_camera cameras[] = {
        {.y_fov_rad = 1.1F, .aspect = 1.5F},
        {.y_fov_rad = 0.4F, .aspect = 0.75F},
        {.is_orthographic = 1, .x_mag = 3, .y_mag = 2},
        {.is_orthographic = 1, .x_mag = 2, .y_mag = 2.5F},
    };
    static const int sizes[][2] = {{1600, 900}, {900, 1600}, {300, 300}, {16, 4000}};
    for (int i = 0; i < 16; i++) {
        const struct scene_camera *file = &cameras[i % 4];
        double half[2], height = file->is_orthographic ? (double)file->y_mag
                                                       : tan(0.5 * (double)file->y_fov_rad);
        double width = file->is_orthographic ? (double)file->x_mag : height * (double)file->aspect;
        look_through(file, 0, sizes[i / 4][0], sizes[i / 4][1], half);
        double fill = fmax(width / half[0], height / half[1]);
        assert_float_equal(fill, 1, 1e-6);
    }
}

static void a_camera_without_aspect_and_a_wish_keep_their_height(void **unused)
{
    (void)unused;
    const struct scene_camera bare = {.y_fov_rad = 1.1F}, wide = {.y_fov_rad = 1.1F, .aspect = 2};
    double half[2];
    look_through(&bare, 0, 200, 900, half);
    assert_float_equal(half[1], tan(0.55), 1e-6);
    look_through(&wide, 30, 200, 900, half);
    assert_float_equal(half[1], tan(15 * 0.017453292519943295), 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_fitted_box_fills_the_image_from_every_side),
        cmocka_unit_test(a_three_quarter_view_is_that_of_a_photographer),
        cmocka_unit_test(each_side_looks_along_its_axis),
        cmocka_unit_test(an_empty_scene_is_fitted_too),
        cmocka_unit_test(an_image_holds_all_that_a_camera_of_the_file_shows),
        cmocka_unit_test(a_camera_without_aspect_and_a_wish_keep_their_height),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

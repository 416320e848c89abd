/* SPDX-License-Identifier: MIT */
/* Fitted cameras: the whole bounding box is in the image, and fills it in one direction. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "renderer/plan/camera.h"
#include "renderer/scene/matrix.h"
#include "tests/support/light_scene.h"

enum { SIDES = 7 };

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
                                           .is_orthographic = trial & 1,
                                           .fov_y_deg = trial % 3 ? 0 : 20};
        struct camera camera;
        struct error err = {0};
        if (!camera_resolve(&camera, &view, &state, &err))
            fail_msg("%s", err.message);
        assert_int_equal(camera.is_orthographic, trial & 1);
        double fill = fill_of(&camera, &state);
        assert_true(fill <= 1 && fill > 0.95);
    }
}

static void each_side_looks_along_its_axis(void **unused)
{
    (void)unused;
    static const double back[SIDES][3] = {{0, 0, 1},  {0, 1, 0},  {1, 0, 0}, {0, 0, 0},
                                          {0, 0, -1}, {-1, 0, 0}, {0, -1, 0}};
    const struct scene scene = {.header = NULL};
    uint64_t seed = 9;
    struct scene_state state = boxed(&seed, &scene);
    for (int side = 0; side < SIDES; side++) {
        struct view view = {.width_px = 64, .height_px = 64};
        view.camera = (struct view_camera){.kind = VIEW_CAMERA_FIT, .fit = (enum view_fit)side};
        struct camera camera;
        struct error err = {0};
        assert_true(camera_resolve(&camera, &view, &state, &err));
        if (side != VIEW_FIT_ISO)
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_fitted_box_fills_the_image_from_every_side),
        cmocka_unit_test(each_side_looks_along_its_axis),
        cmocka_unit_test(an_empty_scene_is_fitted_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

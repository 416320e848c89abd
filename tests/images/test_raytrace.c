/* SPDX-License-Identifier: MIT */
/* The ray-traced ground truth against closed forms, and the rasteriser against the ground truth. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "renderer/raytrace/raytrace.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"
#include "tests/support/raytrace_probe.h"

enum { SIDE_PX = 160 };

static struct imported_scene import_closed_form(const struct closed_form_scene *scene)
{
    struct imported_scene imported = {0};
    struct error err = {0};
    struct scene_file file = {.name = "", .bytes = scene->glb, .size_bytes = scene->size_bytes};
    if (!imported_scene_init(&imported, &file, 1, &err))
        fail_msg("%s", err.message);
    return imported;
}

/* Floor points of a regular grid; t: [point][3] from the ground truth for the scene's one light. */
static void probe_floor(const struct closed_form_scene *scene, const double (*points)[3],
                        size_t count, double (*t)[3])
{
    struct imported_scene imported = import_closed_form(scene);
    struct view view = {.width_px = 1, .height_px = 1};
    struct scene_state state;
    struct error err = {0};
    assert_true(scene_state_init(&state, &imported.scene, &view, &err));
    assert_int_equal(state.light_count, 1);
    struct raytrace_probe_desc desc = {
        .view = &view, .state = &state, .points = points, .point_count = count};
    if (!raytrace_probe(&desc, t, &err))
        fail_msg("%s", err.message);
    scene_state_finish(&state);
    imported_scene_finish(&imported);
}

static void transmittance_equals_the_closed_form(void **state)
{
    (void)state;
    enum { GRID = 41, COUNT = GRID * GRID };
    static double points[COUNT][3], traced[COUNT][3];
    for (int i = 0; i < COUNT; i++) {
        points[i][0] = -2.4 + 4.8 * (i % GRID) / (GRID - 1) + 1e-3;
        points[i][2] = -2.4 + 4.8 * (i / GRID) / (GRID - 1) + 2e-3;
    }
    for (uint64_t seed = 1; seed <= 24; seed++) {
        struct closed_form_scene scene;
        random_panes_scene_build(
            &(struct random_panes_scene_desc){
                .pane_count = 12, .seed = seed, .light = (enum glb_light_type)(seed % 3)},
            &scene);
        probe_floor(&scene, points, COUNT, traced);
        int compared = 0;
        for (int i = 0; i < COUNT; i++) {
            double expected[3];
            /* vertices are stored in f32: within a micrometre of a border either side is right */
            if (closed_form_transmittance(&scene, points[i], expected) < 1e-6)
                continue;
            compared++;
            for (int k = 0; k < 3; k++)
                if (!(fabs(traced[i][k] - expected[k]) <= 1e-6))
                    fail_msg("seed %d point (%g, %g) channel %d: %.9g, closed form %.9g", (int)seed,
                             points[i][0], points[i][2], k, traced[i][k], expected[k]);
        }
        assert_true(compared > COUNT * 9 / 10);
        closed_form_scene_finish(&scene);
    }
}

static struct frame render(struct renderer *renderer, const char *key,
                           enum shadow_technique shadows, const char *camera)
{
    struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .camera = {.kind = VIEW_CAMERA_NODE, .node = camera},
        .quality = {.shadows = shadows,
                    .samples = 1,
                    .shadow_taps = 1,
                    .shadow_resolution = 2048,
                    .reference = shadows == SHADOWS_RAYTRACED},
    };
    struct frame frame;
    struct error err = {0};
    if (!renderer_render(renderer, key, &view, &frame, &err))
        fail_msg("%s", err.message);
    return frame;
}

/* Away from the borders of panes the deep map is exact, so only pixels whose ray passes within a
 * texel of a border may differ: 12 panes at 2048 texels leave under 1 % of them. */
static void deep_shadows_equal_the_ground_truth(void **state)
{
    for (uint64_t seed = 1; seed <= 6; seed++) {
        struct closed_form_scene scene;
        struct rig_scene rig;
        struct error err = {0};
        random_panes_scene_build(
            &(struct random_panes_scene_desc){
                .pane_count = 12, .seed = seed, .light = (enum glb_light_type)(seed % 3)},
            &scene);
        assert_true(rig_scene_from_glb(&rig, *state, "panes", scene.glb, scene.size_bytes, &err));
        struct frame truth = render(*state, rig.key, SHADOWS_RAYTRACED, "Floor");
        struct frame deep = render(*state, rig.key, SHADOWS_DEEP, "Floor");
        double share = image_share_differing(&deep.outputs[VIEW_OUTPUT_COLOR],
                                             &truth.outputs[VIEW_OUTPUT_COLOR], 1e-3, 1);
        printf("seed %d: %.2f %% of pixels differ by more than 1e-3\n", (int)seed, 100 * share);
        if (seed == 1) {
            save_picture(&deep.outputs[VIEW_OUTPUT_COLOR], "panes_deep");
            save_picture(&truth.outputs[VIEW_OUTPUT_COLOR], "panes_raytraced");
        }
        assert_true(share < 0.01);
        frame_finish(&truth);
        frame_finish(&deep);
        rig_scene_finish(&rig, *state);
        closed_form_scene_finish(&scene);
    }
}

/* Spheres of glass, many lights, no shadow: shading, layers and light lists alone, so all pixels
 * but silhouettes must agree. */
static void shading_equals_the_ground_truth(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct error err = {0};
    room_scene_build(&(struct room_scene_desc){.light_count = 60, .seed = 7, .glass_spheres = 15},
                     &scene);
    assert_true(rig_scene_from_glb(&rig, *state, "room", scene.glb, scene.size_bytes, &err));
    struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .camera = {.kind = VIEW_CAMERA_NODE, .node = "Room"},
        .quality = {.shadows = SHADOWS_NONE, .samples = 1},
    };
    struct frame frame;
    if (!renderer_render(*state, rig.key, &view, &frame, &err))
        fail_msg("%s", err.message);
    struct scene_state scene_state;
    struct camera camera;
    struct image truth;
    assert_true(scene_state_init(&scene_state, &rig.imported.scene, &view, &err));
    assert_true(camera_resolve(&camera, &view, &scene_state, &err));
    view.quality.reference = true;
    struct raytrace_desc desc = {.view = &view, .state = &scene_state, .camera = &camera};
    assert_true(raytrace_render(&desc, &truth, NULL, &err));
    double share = image_share_differing(&frame.outputs[VIEW_OUTPUT_COLOR], &truth, 2e-3, 1);
    printf("room: %.2f %% of pixels differ by more than 2e-3\n", 100 * share);
    save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], "room_raster");
    save_picture(&truth, "room_raytraced");
    assert_true(share < 0.01);
    image_finish(&truth);
    frame_finish(&frame);
    scene_state_finish(&scene_state);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

static bool is_never_due(void *context)
{
    (void)context;
    return false;
}

static bool is_unwanted_at_once(void *context)
{
    ++*(int *)context;
    return true;
}

static void a_cancelled_render_leaves_nothing(void **state)
{
    (void)state;
    struct closed_form_scene scene;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 3, .seed = 1}, &scene);
    struct imported_scene imported = import_closed_form(&scene);
    struct view view = {.width_px = 64, .height_px = 64};
    struct scene_state scene_state;
    struct camera camera;
    struct image image;
    struct error err = {0};
    int calls = 0;
    const struct yield_point unwanted = {
        .context = &calls, .should_yield = is_never_due, .is_unwanted = is_unwanted_at_once};
    assert_true(scene_state_init(&scene_state, &imported.scene, &view, &err));
    assert_true(camera_resolve(&camera, &view, &scene_state, &err));
    struct raytrace_desc desc = {
        .view = &view, .state = &scene_state, .camera = &camera, .threads = 2, .yield = &unwanted};
    assert_false(raytrace_render(&desc, &image, NULL, &err));
    assert_int_equal(err.code, ERROR_TIMEOUT);
    assert_null(image.pixels);
    assert_int_in_range(calls, 1, 4);
    /* within a unit, too: the first pixel of a row and the first rays of a tile are asked */
    struct raytrace_stats stats = {0};
    view.quality.reference = true;
    desc.threads = 1;
    assert_false(raytrace_render(&desc, &image, &stats, &(struct error){0}));
    assert_int_equal(stats.camera_rays, 0);
    struct view_light area = {.type = SCENE_LIGHT_DISK,
                              .position = {0, 3, 0},
                              .direction = {0, -1, 0},
                              .color = {1, 1, 1},
                              .intensity = 1,
                              .radius_m = 1};
    view.quality = (struct view_quality){.area_samples = 4096};
    view.lights = &area;
    view.light_count = 1;
    scene_state_finish(&scene_state);
    assert_true(scene_state_init(&scene_state, &imported.scene, &view, &err));
    assert_false(raytrace_render(&desc, &image, &stats, &(struct error){0}));
    assert_int_equal(stats.shadow_rays, 0);
    scene_state_finish(&scene_state);
    imported_scene_finish(&imported);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(transmittance_equals_the_closed_form),
        cmocka_unit_test(deep_shadows_equal_the_ground_truth),
        cmocka_unit_test(shading_equals_the_ground_truth),
        cmocka_unit_test(a_cancelled_render_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Pictures with shadow volumes, and those of silhouettes, equal those whose shadows are traced from
 * the same points, whatever is transparent, cut, curved or large; and what frames say of what
 * volumes cannot do. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/image_checks.h"

enum { SIDE_PX = 160 };

/* Share of pixels that differ from the picture with traced shadows. */
static double compare_with(const struct image *traced, enum shadow_technique shadows,
                           struct renderer *renderer, const struct rig_scene *rig, struct view view,
                           double tolerance)
{
    struct frame frame;
    const char *technique = shadow_technique_name((int)shadows);
    view.quality.shadows = shadows;
    shoot(renderer, rig, &view, &frame);
    assert_image_is_sound(&frame.outputs[VIEW_OUTPUT_COLOR], 1e6);
    assert_true(report_has_pass(&frame.report, "shadow.volumes", technique));
    assert_false(report_has_pass(&frame.report, "shadow.depth", NULL));
    assert_false(report_has_pass(&frame.report, "raytrace", NULL));
    double share = image_share_differing(&frame.outputs[VIEW_OUTPUT_COLOR], traced, tolerance, 1);
    save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], technique);
    frame_finish(&frame);
    return share;
}

/* That of the technique that has more. */
static double compare(struct renderer *renderer, const struct rig_scene *rig, struct view view,
                      const char *name, double tolerance)
{
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    struct image traced = shoot_color(renderer, rig, &view);
    double volume = compare_with(&traced, SHADOWS_VOLUME, renderer, rig, view, tolerance);
    double silhouette = compare_with(&traced, SHADOWS_SILHOUETTE, renderer, rig, view, tolerance);
    printf("%s: %.3f and %.3f %% of pixels differ by more than %g\n", name, 100 * volume,
           100 * silhouette, tolerance);
    save_picture(&traced, "shadow_volumes_traced");
    image_finish(&traced);
    return volume > silhouette ? volume : silhouette;
}

static struct view make_view(const char *camera, int samples)
{
    return (struct view){.width_px = SIDE_PX,
                         .height_px = SIDE_PX,
                         .camera = {.kind = VIEW_CAMERA_NODE, .node = camera},
                         .quality = {.samples = samples}};
}

static struct view look_at(const double eye[3], const double target[3], double ortho_height)
{
    struct view view = make_view("", 1);
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT, .ortho_height = ortho_height};
    memcpy(view.camera.eye, eye, sizeof view.camera.eye);
    memcpy(view.camera.target, target, sizeof view.camera.target);
    return view;
}

/* Of the same points both find the same, but where a ray and a volume round an edge apart. */
static void panes_equal_those_of_traced_pictures(void **state)
{
    for (uint64_t seed = 1; seed <= 6; seed++) {
        struct closed_form_scene scene;
        struct rig_scene rig;
        random_panes_scene_build(
            &(struct random_panes_scene_desc){
                .pane_count = 12, .seed = seed, .light = (enum glb_light_type)(seed % 3)},
            &scene);
        rig_scene_open(&rig, *state, "panes", scene.glb, scene.size_bytes);
        assert_true(compare(*state, &rig, make_view("Floor", 1), "panes", 1e-5) <= 2e-4);
        assert_true(compare(*state, &rig, make_view("Floor", 4), "panes, 4 samples", 1e-5) <= 2e-4);
        struct view view =
            look_at((double[]){2, 6, 5}, (double[]){0, 1.5, 0}, seed % 2 ? 0.0 : 5.0);
        assert_true(compare(*state, &rig, view, "panes from above", 1e-5) <= 2e-4);
        rig_scene_finish(&rig, *state);
        closed_form_scene_finish(&scene);
    }
}

/* Curved bodies, glass among them, many lights. Rays start where curved surfaces are, volumes on
 * their facets, so that pixels near terminators differ. */
static void a_room_of_lights_nearly_equals_its_traced_picture(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    room_scene_build(&(struct room_scene_desc){.light_count = 12, .seed = 7, .glass_spheres = 15},
                     &scene);
    rig_scene_open(&rig, *state, "room", scene.glb, scene.size_bytes);
    assert_true(compare(*state, &rig, make_view("Room", 1), "room", 1e-3) <= 1e-3);
    assert_true(compare(*state, &rig, make_view("Room", 4), "room, 4 samples", 1e-3) <= 2e-3);
    struct view view = look_at((double[]){4, 5, 8}, (double[]){0, 2, 0}, 6);
    assert_true(compare(*state, &rig, view, "room, orthographic", 1e-3) <= 1e-3);
    double cut[4] = {0, -1, 0, 4}; /* takes the ceiling away, and the lamps that hang above */
    view.clip_planes = (const double(*)[4]) & cut;
    view.clip_plane_count = 1;
    assert_true(compare(*state, &rig, view, "room, cut", 1e-3) <= 1e-3);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* One picture in several windows. */
static void a_wide_picture_comes_in_windows(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 12, .seed = 3},
                             &scene);
    rig_scene_open(&rig, *state, "panes", scene.glb, scene.size_bytes);
    struct view view = make_view("", 1);
    view.width_px = 5000;
    view.height_px = 6;
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                       .eye = {0, 0.9, 0},
                                       .target = {0, 0, 0},
                                       .up = {0, 0, 1},
                                       .fov_y_deg = 0.4};
    assert_true(compare(*state, &rig, view, "5000 x 6", 1e-5) <= 2e-4);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(panes_equal_those_of_traced_pictures),
        cmocka_unit_test(a_room_of_lights_nearly_equals_its_traced_picture),
        cmocka_unit_test(a_wide_picture_comes_in_windows),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Pictures by `area`: the shadows of rays to the same points of the same lights, which the
 * reference approaches with more of them; and what a frame says where others have to find them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/closed_form_media.h"
#include "tests/support/image_checks.h"

enum { SIDE_PX = 128 };

static const struct view_light lamps[] = {
    {.type = SCENE_LIGHT_RECT,
     .position = {0.6, 5, 0.4},
     .direction = {-0.1, -1, -0.05},
     .up = {0.2, 0, 1},
     .color = {1, 0.9, 0.8},
     .intensity = 20,
     .width_m = 0.9,
     .height_m = 0.5},
    {.type = SCENE_LIGHT_DISK,
     .position = {-1.2, 4.5, 0.2},
     .direction = {0.25, -1, 0.1},
     .color = {0.5, 0.7, 1},
     .intensity = 20,
     .radius_m = 0.4},
};

/* Share of pixels that differ from those by rays. */
static double compare(struct renderer *renderer, const struct rig_scene *rig, struct view view,
                      const char *name, double tolerance)
{
    struct frame frame;
    view.quality.shadows = SHADOWS_AREA;
    shoot(renderer, rig, &view, &frame);
    assert_image_is_sound(&frame.outputs[VIEW_OUTPUT_COLOR], 1e6);
    assert_true(report_has_pass(&frame.report, "shadow.area", "area"));
    assert_false(report_has_pass(&frame.report, "shadow.trace", NULL));
    assert_int_equal(frame.report.counts.shadow_rays, 0);
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    struct image rays = shoot_color(renderer, rig, &view);
    view.quality.shadows = SHADOWS_NONE;
    struct image bare = shoot_color(renderer, rig, &view);
    double share = image_share_differing(&frame.outputs[VIEW_OUTPUT_COLOR], &rays, tolerance, 1);
    double shadowed = image_share_differing(&bare, &rays, tolerance, 1);
    printf("%s: %.3f %% of pixels differ by more than %g; %.1f %% are in shadow\n", name,
           100 * share, tolerance, 100 * shadowed);
    save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], "area_shadows");
    save_picture(&rays, "area_shadows_rays");
    assert_true(shadowed > 0.05);
    frame_finish(&frame);
    image_finish(&rays);
    image_finish(&bare);
    return share;
}

static struct view make_view(const char *camera, int samples)
{
    return (struct view){.width_px = SIDE_PX,
                         .height_px = SIDE_PX,
                         .camera = {.kind = VIEW_CAMERA_NODE, .node = camera},
                         .quality = {.samples = samples}};
}

static void open_panes(struct rig_scene *rig, struct renderer *renderer, uint64_t seed)
{
    struct closed_form_scene scene;
    random_panes_scene_build(
        &(struct random_panes_scene_desc){
            .pane_count = 12, .seed = seed, .light = (enum glb_light_type)(seed % 3)},
        &scene);
    rig_scene_open(rig, renderer, "panes", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

static void points_spots_and_suns_cast_the_shadows_of_rays(void **state)
{
    for (uint64_t seed = 1; seed <= 6; seed++) {
        struct rig_scene rig;
        open_panes(&rig, *state, seed);
        assert_true(compare(*state, &rig, make_view("Floor", 1), "panes", 2e-4) <= 1e-3);
        rig_scene_finish(&rig, *state);
    }
}

static void areas_cast_the_shadows_of_rays_to_the_same_points(void **state)
{
    for (uint64_t seed = 1; seed <= 3; seed++) {
        struct rig_scene rig;
        struct view view = make_view("Floor", 1);
        open_panes(&rig, *state, seed);
        view.lights = lamps;
        view.light_count = 2;
        view.ignore_scene_lights = seed > 1;
        for (int samples = 1; samples <= 50; samples += 1 + 3 * samples) {
            view.quality.area_samples = samples;
            assert_true(compare(*state, &rig, view, "areas", 2e-4) <= 2e-3);
        }
        rig_scene_finish(&rig, *state);
    }
}

/* From the least side that a request may name to the largest. */
static void lights_of_any_size_cast_the_shadows_of_rays(void **state)
{
    static const double sides_m[] = {1e-9, 1e-4, 30, 3e3, 1e9};
    struct rig_scene rig;
    open_panes(&rig, *state, 2);
    for (size_t i = 0; i < sizeof sides_m / sizeof *sides_m; i++) {
        struct view view = make_view("Floor", 1);
        struct view_light sized[2] = {lamps[0], lamps[1]};
        char name[32];
        sized[0].width_m = sized[0].height_m = sides_m[i];
        sized[1].radius_m = 0.5 * sides_m[i];
        for (int k = 0; k < 2; k++) /* of radiance: small ones are bright */
            sized[k].intensity = fmax(20, 10 / (sides_m[i] * sides_m[i]));
        view.lights = sized;
        view.light_count = 2;
        view.ignore_scene_lights = true;
        view.quality.area_samples = 16;
        snprintf(name, sizeof name, "sides of %g m", sides_m[i]);
        assert_true(compare(*state, &rig, view, name, 2e-4) <= 2e-3);
    }
    rig_scene_finish(&rig, *state);
}

/* Balls, whose shadows begin on the curved surface that their vertices describe. */
static void a_room_of_curves_has_the_shadows_of_rays(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    room_scene_build(&(struct room_scene_desc){.light_count = 12, .seed = 7}, &scene);
    rig_scene_open(&rig, *state, "room", scene.glb, scene.size_bytes);
    struct view view = make_view("Room", 1);
    view.lights = lamps;
    view.light_count = 2;
    assert_true(compare(*state, &rig, view, "room", 1e-3) <= 5e-3);
    view.quality.samples = 4;
    assert_true(compare(*state, &rig, view, "room, 4 samples", 5e-3) <= 5e-3);
    view.quality.samples = 1;
    const double planes[2][4] = {{0, -1, 0, 3.5}, {1, 0, 0.2, 1}};
    view.clip_planes = planes;
    view.clip_plane_count = 2;
    assert_true(compare(*state, &rig, view, "room, cut", 1e-3) <= 5e-3);
    view.clip_plane_count = 0;
    view.camera = (struct view_camera){
        .kind = VIEW_CAMERA_LOOK_AT, .eye = {4, 5, 8}, .target = {0, 1, 0}, .ortho_height = 6};
    assert_true(compare(*state, &rig, view, "room, orthographic", 1e-3) <= 5e-3);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* With as many points on the lights as the reference has, but others. */
static void penumbrae_approach_the_reference(void **state)
{
    struct rig_scene rig;
    struct view view = make_view("Floor", 1);
    double before = 1;
    open_panes(&rig, *state, 2);
    view.lights = lamps;
    view.light_count = 2;
    view.ignore_scene_lights = true;
    view.quality.reference = true;
    view.quality.area_samples = 1024;
    struct image reference = shoot_color(*state, &rig, &view);
    view.quality.reference = false;
    view.quality.shadows = SHADOWS_AREA;
    for (int samples = 4; samples <= 256; samples *= 4) {
        view.quality.area_samples = samples;
        struct image image = shoot_color(*state, &rig, &view);
        double error = mean_error(&image, &reference);
        printf("%d points: mean error %.5f\n", samples, error);
        assert_true(error < 0.6 * before);
        before = error;
        image_finish(&image);
    }
    assert_true(before < 3e-3); /* the noise of 256 points */
    image_finish(&reference);
    rig_scene_finish(&rig, *state);
}

/* Sum of second differences along rows, of one channel: noise has much of it, penumbrae little. */
static double roughness(const struct image *image)
{
    double sum = 0;
    for (int y = 0; y < SIDE_PX; y++)
        for (int x = 1; x + 1 < SIDE_PX; x++) {
            const float *at = (const float *)image->pixels + 4 * ((size_t)y * SIDE_PX + (size_t)x);
            sum += fabs((double)at[-4] - 2 * (double)at[0] + (double)at[4]);
        }
    return sum;
}

/* With the same points at every pixel, and with tables, the error is no more, beyond a few in
 * 10,000. Panes are transparent, whose masks are those of planes. */
static void the_published_form_is_as_near(struct renderer *renderer, const struct rig_scene *rig,
                                          struct view view, const char *name)
{
    struct frame frame;
    view.width_px = view.height_px = SIDE_PX / 2;
    view.lights = lamps;
    view.light_count = 2;
    view.ignore_scene_lights = true;
    view.quality.reference = true;
    view.quality.area_samples = 1024;
    struct image reference = shoot_color(renderer, rig, &view);
    view.quality.reference = false;
    view.quality.shadows = SHADOWS_AREA;
    view.quality.area_samples = 200;
    struct image turned = shoot_color(renderer, rig, &view);
    view.quality.faithful = true;
    shoot(renderer, rig, &view, &frame);
    const struct image *fixed = &frame.outputs[VIEW_OUTPUT_COLOR];
    assert_image_is_sound(fixed, 1e6);
    assert_true(report_has_pass(&frame.report, "shadow.area", "area"));
    double of_turned = mean_error(&turned, &reference), of_fixed = mean_error(fixed, &reference);
    printf("%s: mean error %.5f turned, %.5f fixed\n", name, of_turned, of_fixed);
    save_picture(&turned, "area_turned");
    save_picture(fixed, "area_published");
    assert_true(of_fixed < 2 * of_turned + 3e-4);
    image_finish(&turned);
    image_finish(&reference);
    frame_finish(&frame);
}

/* Few points are noise where pixels differ in them, and bands where they do not. */
static void the_published_form_has_no_noise(struct renderer *renderer, const struct rig_scene *rig,
                                            struct view view)
{
    view.lights = lamps;
    view.light_count = 2;
    view.ignore_scene_lights = true;
    view.quality.shadows = SHADOWS_AREA;
    view.quality.area_samples = 4;
    struct image turned = shoot_color(renderer, rig, &view);
    view.quality.faithful = true;
    struct image fixed = shoot_color(renderer, rig, &view);
    printf("roughness %.2f turned, %.2f fixed\n", roughness(&turned), roughness(&fixed));
    save_picture(&turned, "area_turned_4");
    save_picture(&fixed, "area_published_4");
    assert_true(roughness(&fixed) < 0.5 * roughness(&turned));
    image_finish(&turned);
    image_finish(&fixed);
}

static void as_published(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    open_panes(&rig, *state, 2);
    the_published_form_is_as_near(*state, &rig, make_view("Floor", 1), "panes");
    the_published_form_has_no_noise(*state, &rig, make_view("Floor", 1));
    rig_scene_finish(&rig, *state);
    room_scene_build(&(struct room_scene_desc){.light_count = 12, .seed = 7}, &scene);
    rig_scene_open(&rig, *state, "room", scene.glb, scene.size_bytes);
    the_published_form_is_as_near(*state, &rig, make_view("Room", 1), "room");
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* Of the programs that a frame of the view may need, how many are by this define. */
static int count_programs(struct renderer *renderer, const struct rig_scene *rig,
                          const struct view *view, const char *define)
{
    struct program_list list = {0};
    struct error err = {0};
    int count = 0;
    if (!renderer_list_programs(renderer, rig->key, view, &list, &err))
        fail_msg("%s", err.message);
    for (size_t i = 0; i < list.count; i++)
        if (list.items[i].compute && !strcmp(list.items[i].compute, "area_find.comp.glsl"))
            count += strstr(list.items[i].defines, define) != NULL;
    program_list_finish(&list);
    return count;
}

/* Through panes, around curves and past clip planes. */
static void shoot_posing(bool poses_as_hardware, const struct closed_form_scene *scene,
                         const char *camera, int samples, struct image *images)
{
    const double planes[2][4] = {{0, -1, 0, 3.5}, {1, 0, 0.2, 1}};
    struct renderer *renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.poses_as_hardware = poses_as_hardware});
    struct rig_scene rig;
    struct view view = make_view(camera, 1);
    view.width_px = view.height_px = SIDE_PX / 2;
    view.lights = lamps;
    view.light_count = 2;
    view.ignore_scene_lights = true;
    view.clip_planes = planes;
    view.quality.shadows = SHADOWS_AREA;
    view.quality.area_samples = samples;
    rig_scene_open(&rig, renderer, "alike", scene->glb, scene->size_bytes);
    assert_int_equal(count_programs(renderer, &rig, &view, "GROUPS=4"), !poses_as_hardware);
    for (int i = 0; i < 2; i++) {
        view.clip_plane_count = 2 * i;
        images[i] = shoot_color(renderer, &rig, &view);
    }
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
}

/* Graphics hardware takes four points of a light in a pass where our own processors take sixteen;
 * with 17 neither divides them. */
static void passes_over_points_of_lights_change_no_bit(void **state)
{
    struct closed_form_scene scenes[2];
    (void)state;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 12, .seed = 2},
                             &scenes[0]);
    room_scene_build(&(struct room_scene_desc){.light_count = 1, .seed = 7}, &scenes[1]);
    for (int i = 0; i < 2; i++) {
        struct image images[2][2];
        for (int is_hardware = 0; is_hardware < 2; is_hardware++)
            shoot_posing(is_hardware, &scenes[i], i ? "Room" : "Floor", 17, images[is_hardware]);
        for (int k = 0; k < 2; k++) {
            assert_same_bits(&images[0][k], &images[1][k]);
            image_finish(&images[0][k]);
            image_finish(&images[1][k]);
        }
        closed_form_scene_finish(&scenes[i]);
    }
}

static void casters_that_change_light_by_place_leave_the_frame_to_rays(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct frame frame;
    projector_scene_build(&(struct projector_scene_desc){.cells = 4}, &scene);
    rig_scene_open(&rig, *state, "projector", scene.glb, scene.size_bytes);
    struct view view = make_view("Wall", 1);
    view.quality.shadows = SHADOWS_AREA;
    shoot(*state, &rig, &view, &frame);
    assert_true(report_has_warning(&frame.report, "area cannot follow light through 1 caster"));
    assert_true(report_has_pass(&frame.report, "shadow.trace", "raytraced-shadows"));
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    struct image rays = shoot_color(*state, &rig, &view);
    assert_same_bits(&frame.outputs[VIEW_OUTPUT_COLOR], &rays);
    frame_finish(&frame);
    image_finish(&rays);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_spots_and_suns_cast_the_shadows_of_rays),
        cmocka_unit_test(areas_cast_the_shadows_of_rays_to_the_same_points),
        cmocka_unit_test(lights_of_any_size_cast_the_shadows_of_rays),
        cmocka_unit_test(a_room_of_curves_has_the_shadows_of_rays),
        cmocka_unit_test(penumbrae_approach_the_reference),
        cmocka_unit_test(as_published),
        cmocka_unit_test(casters_that_change_light_by_place_leave_the_frame_to_rays),
    };
    const struct CMUnitTest alone[] = {
        cmocka_unit_test(passes_over_points_of_lights_change_no_bit)};
    int failed = cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
    return failed + cmocka_run_group_tests(alone, NULL, NULL);
}

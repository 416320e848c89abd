/* SPDX-License-Identifier: MIT */
/* Rasterised pictures whose shadows are traced: equal to the pictures that are traced as a whole,
 * whatever is transparent, cut, curved or large; and what the frame says of itself. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "renderer/base/matrix.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/scene/camera.h"
#include "renderer/shadows/shadow_traced.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/closed_form_media.h"
#include "tests/support/image_checks.h"

enum { SIDE_PX = 160 };

/* Share of pixels that differ from the picture that is traced as a whole. */
static double compare(struct renderer *renderer, const struct rig_scene *rig, struct view view,
                      const char *name, double tolerance)
{
    struct frame frame;
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    shoot(renderer, rig, &view, &frame);
    assert_image_is_sound(&frame.outputs[VIEW_OUTPUT_COLOR], 1e6);
    assert_true(report_has_pass(&frame.report, "shadow.trace", "raytraced-shadows"));
    assert_false(report_has_pass(&frame.report, "shadow.depth", NULL));
    view.quality.shadows = SHADOWS_RAYTRACED;
    struct image whole = shoot_color(renderer, rig, &view);
    double share = image_share_differing(&frame.outputs[VIEW_OUTPUT_COLOR], &whole, tolerance, 1);
    printf("%s: %.3f %% of pixels differ by more than %g; %llu rays\n", name, 100 * share,
           tolerance, (unsigned long long)frame.report.counts.shadow_rays);
    save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], "raytraced_shadows");
    save_picture(&whole, "raytraced_whole");
    frame_finish(&frame);
    image_finish(&whole);
    return share;
}

/* The same of the pictures without any shadow: surfaces alone. */
static double compare_bare(struct renderer *renderer, const struct rig_scene *rig, struct view view,
                           double tolerance)
{
    struct scene_state state;
    struct camera camera;
    struct image traced;
    struct error err = {0};
    view.quality.shadows = SHADOWS_NONE;
    struct image raster = shoot_color(renderer, rig, &view);
    assert_true(scene_state_init(&state, &rig->imported.scene, &view, &err));
    assert_true(camera_resolve(&camera, &view, &state, &err));
    struct raytrace_desc desc = {.view = &view, .state = &state, .camera = &camera, .samples = 4};
    assert_true(raytrace_render(&desc, &traced, NULL, &err));
    double share = image_share_differing(&raster, &traced, tolerance, 1);
    image_finish(&traced);
    image_finish(&raster);
    scene_state_finish(&state);
    return share;
}

static struct view make_view(const char *camera, int samples)
{
    return (struct view){.width_px = SIDE_PX,
                         .height_px = SIDE_PX,
                         .camera = {.kind = VIEW_CAMERA_NODE, .node = camera},
                         .quality = {.samples = samples}};
}

/* At pixel centres both shade the same points. What differs are pixels and rays at edges, which
 * f32 sends past their other side. */
static void pixels_equal_those_of_whole_traced_pictures(void **state)
{
    for (uint64_t seed = 1; seed <= 6; seed++) {
        struct closed_form_scene scene;
        struct rig_scene rig;
        random_panes_scene_build(
            &(struct random_panes_scene_desc){
                .pane_count = 12, .seed = seed, .light = (enum glb_light_type)(seed % 3)},
            &scene);
        rig_scene_open(&rig, *state, "panes", scene.glb, scene.size_bytes);
        assert_true(compare(*state, &rig, make_view("Floor", 1), "panes", 2e-4) <= 1e-3);
        rig_scene_finish(&rig, *state);
        closed_form_scene_finish(&scene);
    }
}

/* Curved bodies, glass among them, many lights. In an antialiased picture pixels on silhouettes
 * differ without shadows already, because surfaces and their normals there are not taken at the
 * same points; shadows add none. */
static void a_room_of_lights_equals_its_whole_traced_picture(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    room_scene_build(&(struct room_scene_desc){.light_count = 60, .seed = 7, .glass_spheres = 15},
                     &scene);
    rig_scene_open(&rig, *state, "room", scene.glb, scene.size_bytes);
    assert_true(compare(*state, &rig, make_view("Room", 1), "room", 1e-3) <= 5e-3);
    struct view view = make_view("Room", 4);
    double bare = compare_bare(*state, &rig, view, 5e-3);
    printf("without shadows %.3f %%; ", 100 * bare);
    assert_true(compare(*state, &rig, view, "room, 4 samples", 5e-3) <= bare);
    view = make_view("", 1);
    view.camera = (struct view_camera){
        .kind = VIEW_CAMERA_LOOK_AT, .eye = {4, 5, 8}, .target = {0, 2, 0}, .ortho_height = 6};
    assert_true(compare(*state, &rig, view, "room, orthographic", 1e-3) <= 5e-3);
    double cut[4] = {0, -1, 0, 4}; /* takes the ceiling away, and the lamps that hang above */
    view.clip_planes = (const double(*)[4]) & cut;
    view.clip_plane_count = 1;
    assert_true(compare(*state, &rig, view, "room, cut", 1e-3) <= 5e-3);
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
    assert_true(compare(*state, &rig, view, "5000 x 6", 2e-4) <= 2e-3);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* Lights that shine from below fill the lists, brighten nothing and send no ray; the filters of all
 * of them do not fit into one slice. */
static void more_filters_than_one_slice_holds_lose_nothing(void **state)
{
    enum { LIGHTS = 140, SIDE = 400 };
    static struct view_light lights[LIGHTS];
    struct closed_form_scene scene;
    struct rig_scene rig;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 6, .seed = 4}, &scene);
    rig_scene_open(&rig, *state, "panes", scene.glb, scene.size_bytes);
    struct view view = make_view("Floor", 1);
    view.width_px = view.height_px = SIDE;
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    struct image few = shoot_color(*state, &rig, &view);
    for (int i = 0; i < LIGHTS; i++)
        lights[i] = (struct view_light){.type = SCENE_LIGHT_DIRECTIONAL,
                                        .direction = {0.1, 1, 0.01 * i},
                                        .color = {1, 1, 1},
                                        .intensity = 1};
    view.lights = lights;
    view.light_count = LIGHTS;
    assert_true((long)SIDE * SIDE * (LIGHTS + 1) > TRACED_FILTERS_MAX);
    struct frame frame;
    shoot(*state, &rig, &view, &frame);
    assert_images_close(&frame.outputs[VIEW_OUTPUT_COLOR], &few, 1e-3, 1e-6);
    assert_int_equal(frame.report.counts.shadowed_lights, LIGHTS + 1);
    assert_true(frame.report.counts.shadow_rays <= 2 * SIDE * SIDE);
    frame_finish(&frame);
    image_finish(&few);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* -- area lights -- */

static const struct view_light soft_lights[] = {{.type = SCENE_LIGHT_RECT,
                                                 .position = {0.6, 2, -0.4},
                                                 .direction = {-0.3, -1, 0.2},
                                                 .up = {0.1, 0.2, 1},
                                                 .color = {1, 0.8, 0.6},
                                                 .intensity = 6,
                                                 .width_m = 0.9,
                                                 .height_m = 0.5},
                                                {.type = SCENE_LIGHT_DISK,
                                                 .position = {-0.7, 1.8, 0.5},
                                                 .direction = {0.4, -1, -0.2},
                                                 .color = {0.5, 0.7, 1},
                                                 .intensity = 8,
                                                 .radius_m = 0.4},
                                                {.type = SCENE_LIGHT_DISK,
                                                 .position = {0.5, 1.5, 0.8},
                                                 .direction = {0, -1, 0},
                                                 .color = {1, 1, 1},
                                                 .intensity = 2,
                                                 .casts_no_shadow = true,
                                                 .radius_m = 0.3}};

/* Both take the same points of each light: nothing differs but pixels at edges. */
static void soft_shadows_equal_those_of_whole_traced_pictures(void **state)
{
    static const int area_samples[] = {1, 7, 16};
    for (int i = 0; i < 3; i++) {
        struct closed_form_scene scene;
        struct rig_scene rig;
        random_panes_scene_build(
            &(struct random_panes_scene_desc){.pane_count = 12, .seed = 20 + (uint64_t)i}, &scene);
        rig_scene_open(&rig, *state, "panes", scene.glb, scene.size_bytes);
        struct view view = make_view("Floor", 1);
        view.lights = soft_lights;
        view.light_count = 3;
        view.quality.area_samples = area_samples[i];
        assert_true(compare(*state, &rig, view, "panes under areas", 5e-4) <= 2e-3);
        rig_scene_finish(&rig, *state);
        closed_form_scene_finish(&scene);
    }
    struct closed_form_scene scene;
    struct rig_scene rig;
    room_scene_build(&(struct room_scene_desc){.light_count = 3, .seed = 5, .glass_spheres = 10},
                     &scene);
    rig_scene_open(&rig, *state, "room", scene.glb, scene.size_bytes);
    struct view view = make_view("Room", 1);
    view.lights = soft_lights;
    view.light_count = 3;
    assert_true(compare(*state, &rig, view, "room under areas", 2e-3) <= 5e-3);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* The most points and samples that there are, of three lights, in dispatches of a few lights: no
 * loop ends before its time. */
static void no_point_of_many_is_lost(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    room_scene_build(&(struct room_scene_desc){.light_count = 1, .seed = 5}, &scene);
    rig_scene_open(&rig, *state, "room", scene.glb, scene.size_bytes);
    struct view view = make_view("Room", 4);
    struct view_light lights[5];
    for (int i = 0; i < 5; i++) {
        lights[i] = soft_lights[i % 2];
        lights[i].casts_no_shadow = i > 0; /* rays are not what is asked here */
    }
    view.width_px = view.height_px = 12;
    view.lights = lights;
    view.light_count = 5;
    view.quality.area_samples = 4096;
    double bare = compare_bare(*state, &rig, view, 5e-3);
    assert_true(compare(*state, &rig, view, "4096 points", 5e-3) <= bare + 0.01);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* Lambert 1760: irradiance of a rectangle in a plane y = height, on a floor, over its luminance. */
static double rect_irradiance(const double low[2], const double high[2], double height,
                              const double at[2])
{
    const double corners[4][2] = {
        {low[0], low[1]}, {high[0], low[1]}, {high[0], high[1]}, {low[0], high[1]}};
    double sum = 0;
    for (int i = 0; i < 4; i++) {
        double a[3] = {corners[i][0] - at[0], height, corners[i][1] - at[1]};
        double b[3] = {corners[(i + 1) % 4][0] - at[0], height, corners[(i + 1) % 4][1] - at[1]};
        double across[3];
        vec3_normalize(a);
        vec3_normalize(b);
        vec3_cross(a, b, across);
        if (vec3_normalize(across))
            sum += acos(fmin(vec3_dot(a, b), 1)) * across[1];
    }
    return fabs(sum) / 2;
}

/* A7 as a picture: a floor under a half-plane 1 m above and a rectangle 3 m above it, of which each
 * point of the floor sees a rectangle. Each 1/1024 of the light's width holds one of the points. */
static void penumbra_of_a_half_plane_follows_lamberts_formula(void **state)
{
    enum { SAMPLES = 1024, PICTURE_PX = 64 };
    static const double eye_m = 0.9, light_m = 3, half[2] = {0.4, 0.3}, luminance = 50;
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct glb_builder *builder = closed_form_begin(&scene, "Half-plane", 0);
    closed_form_floor(&scene, builder, 4);
    closed_form_quad(builder, "Blocker", closed_form_receiver(&scene, builder),
                     (double[]){-4, 1, -4}, (double[]){4, 0, 0}, (double[]){0, 0, 8});
    closed_form_end(&scene, builder);
    rig_scene_open(&rig, *state, "half-plane", scene.glb, scene.size_bytes);
    struct view_light light = {.type = SCENE_LIGHT_RECT,
                               .position = {0, light_m, 0},
                               .direction = {0, -1, 0},
                               .up = {0, 0, 1},
                               .color = {1, 1, 1},
                               .intensity = (float)luminance,
                               .width_m = 2 * (float)half[0],
                               .height_m = 2 * (float)half[1]};
    struct view view = make_view("", 1);
    view.width_px = view.height_px = PICTURE_PX;
    view.lights = &light;
    view.light_count = 1;
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                       .eye = {0, eye_m, 0},
                                       .target = {0, 0, 0},
                                       .up = {0, 0, -1},
                                       .fov_y_deg = 90};
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    view.quality.area_samples = SAMPLES;
    struct frame frame;
    shoot(*state, &rig, &view, &frame);
    double worst = 0, brightest = 0;
    int partly = 0;
    for (int i = 0; i < PICTURE_PX * PICTURE_PX; i++) {
        double x = eye_m * (2 * (i % PICTURE_PX + 0.5) / PICTURE_PX - 1);
        double z = eye_m * (2 * (i / PICTURE_PX + 0.5) / PICTURE_PX - 1);
        double low[2] = {fmin(fmax(-half[0], x * (1 - light_m)), half[0]), -half[1]};
        double irradiance = luminance * rect_irradiance(low, half, light_m, (double[]){x, z});
        double expected = scene.albedo / M_PI * irradiance;
        const float *pixel =
            image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], i % PICTURE_PX, i / PICTURE_PX);
        worst = fmax(worst, fabs((double)pixel[0] - expected));
        brightest = fmax(brightest, expected);
        partly += low[0] > -half[0] && low[0] < half[0];
    }
    printf("error of the penumbra %.2g of the brightest, %d pixels in it\n", worst / brightest,
           partly);
    assert_true(worst <= 1.1 / SAMPLES * brightest);
    assert_int_in_range(partly, 64 * 13, 64 * 15);
    assert_false(report_has_warning(&frame.report, "centre"));
    assert_true(frame.report.counts.shadow_rays >= PICTURE_PX * PICTURE_PX / 2 * SAMPLES);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* Points on an area light that shines upward: no ray and no light, but room for their filters. */
static void more_points_than_a_window_holds_lose_nothing(void **state)
{
    enum { SAMPLES = 800 };
    struct closed_form_scene scene;
    struct rig_scene rig;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 6, .seed = 4}, &scene);
    rig_scene_open(&rig, *state, "panes", scene.glb, scene.size_bytes);
    struct view view = make_view("Floor", 1);
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    view.quality.area_samples = SAMPLES;
    struct image without = shoot_color(*state, &rig, &view);
    struct view_light light = soft_lights[0];
    light.direction[1] = 1;
    view.lights = &light;
    view.light_count = 1;
    assert_true((long)SIDE_PX * SIDE_PX * SAMPLES > TRACED_FILTERS_MAX);
    struct frame frame;
    shoot(*state, &rig, &view, &frame);
    assert_true(report_has_warning(&frame.report, "windows"));
    assert_images_close(&frame.outputs[VIEW_OUTPUT_COLOR], &without, 1e-5, 1e-6);
    frame_finish(&frame);
    image_finish(&without);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* -- rules of materials -- */

/* Three panes of one node above a floor, 0.1 m apart, that let half of the light through. */
static void build_stack(struct closed_form_scene *scene)
{
    struct glb_builder *builder = closed_form_begin(scene, "Stack", 0);
    struct shape shape = {0};
    closed_form_floor(scene, builder, 4);
    for (int i = 0; i < 3; i++)
        shape_add_quad(&shape, (double[]){-2, 0.8 + 0.1 * i, 2}, (double[]){4, 0, 0},
                       (double[]){0, 0, -4});
    struct glb_material_desc material = {.name = "Panes",
                                         .base_color = {1, 0.6, 0.2, 0.5},
                                         .roughness = 1,
                                         .has_ior = true,
                                         .ior = 1,
                                         .alpha_mode = GLB_BLEND,
                                         .is_double_sided = true};
    int panes = glb_builder_add_material(builder, &material);
    struct glb_node_desc node = {.name = "Stack",
                                 .mesh = shape_give_mesh(&shape, builder, "Stack", panes)};
    glb_builder_add_node(builder, &node);
    closed_form_end(scene, builder);
}

/* The mean of the middle of the picture, red. */
static double look(struct renderer *renderer, const struct rig_scene *rig, const struct view *view)
{
    struct image image = shoot_color(renderer, rig, view);
    double sum = 0;
    for (int i = 0; i < 64; i++)
        sum += (double)image_pixel_f32(&image, 12 + i % 8, 12 + i / 8)[0] / 64;
    image_finish(&image);
    return sum;
}

/* From above layers are seen that others of their node shadow, from below the floor in the light of
 * all. Maps, whose texels see the same everywhere here, say what the rules mean. */
static void self_shadow_and_cast_once_hold_for_rays(void **state)
{
    static const struct view_quality techniques[] = {
        {.shadows = SHADOWS_DEEP},
        {.shadows = SHADOWS_RAYTRACED, .samples = 1},
        {.shadows = SHADOWS_RAYTRACED_SHADOWS, .samples = 1},
        {.reference = true, .samples = 1}};
    static const double eyes_m[] = {2, 0.6};
    struct closed_form_scene scene;
    struct rig_scene rig;
    build_stack(&scene);
    rig_scene_open(&rig, *state, "stack", scene.glb, scene.size_bytes);
    struct view_light light = {.type = SCENE_LIGHT_DIRECTIONAL,
                               .direction = {0.2, -1, 0.1},
                               .color = {1, 1, 1},
                               .intensity = 3};
    double floor[4];
    for (int rule = 0; rule < 4; rule++) {
        struct view_material_override override = {.material = "Panes",
                                                  .has_self_shadow = true,
                                                  .self_shadow = !(rule & 1),
                                                  .has_cast_once = true,
                                                  .cast_once = rule & 2};
        for (int e = 0; e < 2; e++) {
            double seen[4];
            struct view view = make_view("", 1);
            view.width_px = view.height_px = 32;
            view.lights = &light;
            view.light_count = 1;
            view.materials = &override;
            view.material_override_count = 1;
            view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                               .eye = {0, eyes_m[e], 0},
                                               .target = {0, 0, 0},
                                               .up = {0, 0, -1},
                                               .fov_y_deg = 20};
            for (int i = 0; i < 4; i++) {
                view.quality = techniques[i];
                seen[i] = look(*state, &rig, &view);
                assert_true(fabs(seen[i] / seen[0] - 1) < 1e-3);
            }
            printf("rules %d from %g m: %.5g %.5g %.5g %.5g\n", rule, eyes_m[e], seen[0], seen[1],
                   seen[2], seen[3]);
            if (e == 0)
                continue;
            floor[rule] = seen[1];
            /* red: each filter halves it */
            assert_true(fabs(floor[rule] / floor[0] / (rule & 2 ? 4 : 1) - 1) < 1e-3);
        }
    }
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* -- what the frame says -- */

static void rays_are_only_for_lights_with_casters(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct view_light lamp = {
        .type = SCENE_LIGHT_POINT, .position = {0, 2, 0}, .color = {1, 1, 1}, .intensity = 5};
    media_scene_build(&(struct media_scene_desc){.has_floor = true}, &scene);
    rig_scene_open(&rig, *state, "floor", scene.glb, scene.size_bytes);
    struct view view = make_view("", 1);
    view.camera =
        (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 1, 1}, .target = {0, 0, 0}};
    view.lights = &lamp;
    view.light_count = 1;
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    lamp.casts_no_shadow = true;
    struct frame frame;
    shoot(*state, &rig, &view, &frame);
    assert_false(report_has_pass(&frame.report, "shadow", NULL));
    assert_false(report_has_pass(&frame.report, "raytrace", NULL));
    assert_int_equal(frame.report.counts.shadow_rays, 0);
    view.quality.shadows = SHADOWS_NONE;
    struct image bare = shoot_color(*state, &rig, &view);
    assert_same_bits(&frame.outputs[VIEW_OUTPUT_COLOR], &bare);
    frame_finish(&frame);
    image_finish(&bare);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* The structure is the ray tracer's own: either form takes over what the other has built. */
static void the_scene_is_kept_between_frames_and_forms(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct frame frames[3];
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 8, .seed = 9}, &scene);
    rig_scene_open(&rig, *state, "panes", scene.glb, scene.size_bytes);
    struct view view = make_view("Floor", 4);
    for (int i = 0; i < 3; i++) {
        view.quality.shadows = i == 1 ? SHADOWS_RAYTRACED : SHADOWS_RAYTRACED_SHADOWS;
        shoot(*state, &rig, &view, &frames[i]);
    }
    assert_true(report_has_pass(&frames[0].report, "raytrace.build", "raytraced-shadows"));
    assert_true(report_has_reused(&frames[1].report, "raytrace.build"));
    assert_true(report_has_reused(&frames[2].report, "raytrace.build"));
    assert_same_bits(&frames[0].outputs[VIEW_OUTPUT_COLOR], &frames[2].outputs[VIEW_OUTPUT_COLOR]);
    for (int i = 0; i < 3; i++)
        frame_finish(&frames[i]);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* Pixels that a wide pane covers in part, with their middles above its horizon: the pane's plane is
 * nowhere there. */
static void a_pane_to_its_horizon_has_its_points_in_the_scene(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct glb_builder *builder = closed_form_begin(&scene, "Horizon", 0);
    struct shape shape = {0};
    struct glb_material_desc material = {.name = "Pane",
                                         .base_color = {1, 0.6, 0.2, 0.5},
                                         .roughness = 1,
                                         .alpha_mode = GLB_BLEND,
                                         .is_double_sided = true};
    shape_add_quad(&shape, (double[]){-1e4, 0, 1e4}, (double[]){2e4, 0, 0}, (double[]){0, 0, -2e4});
    shape_add_quad(&shape, (double[]){-1, 0.5, -8}, (double[]){2, 0, 0}, (double[]){0, 0, -2});
    int panes = glb_builder_add_material(builder, &material);
    struct glb_node_desc node = {.name = "Panes",
                                 .mesh = shape_give_mesh(&shape, builder, "Panes", panes)};
    glb_builder_add_node(builder, &node);
    closed_form_end(&scene, builder);
    rig_scene_open(&rig, *state, "horizon", scene.glb, scene.size_bytes);
    struct view view = make_view("", 4);
    const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {0.3, -1, -0.2},
                                   .color = {1, 1, 1},
                                   .intensity = 3};
    view.lights = &sun;
    view.light_count = 1;
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    for (int tilt = 0; tilt < 8; tilt++) { /* another share of the pixels each */
        struct frame frame;
        view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                           .eye = {0, 1, 0},
                                           .target = {0, 1 + 0.001 * tilt, -1},
                                           .up = {0.02, 1, 0}};
        shoot(*state, &rig, &view, &frame);
        assert_image_is_sound(&frame.outputs[VIEW_OUTPUT_COLOR], 1e6);
        assert_true(frame.report.counts.shadow_rays > 0);
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

static void linked_light_lists_are_refused(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 1, .seed = 1}, &scene);
    rig_scene_open(&rig, *state, "panes", scene.glb, scene.size_bytes);
    struct view view = make_view("Floor", 1);
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    view.quality.light_lists = VIEW_LIGHT_LISTS_LINKED;
    struct frame frame;
    struct error err = {0};
    assert_false(renderer_render(*state, rig.key, &view, &frame, &err));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    assert_non_null(strstr(err.message, "light_lists"));
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pixels_equal_those_of_whole_traced_pictures),
        cmocka_unit_test(a_room_of_lights_equals_its_whole_traced_picture),
        cmocka_unit_test(a_wide_picture_comes_in_windows),
        cmocka_unit_test(more_filters_than_one_slice_holds_lose_nothing),
        cmocka_unit_test(soft_shadows_equal_those_of_whole_traced_pictures),
        cmocka_unit_test(no_point_of_many_is_lost),
        cmocka_unit_test(self_shadow_and_cast_once_hold_for_rays),
        cmocka_unit_test(penumbra_of_a_half_plane_follows_lamberts_formula),
        cmocka_unit_test(more_points_than_a_window_holds_lose_nothing),
        cmocka_unit_test(rays_are_only_for_lights_with_casters),
        cmocka_unit_test(the_scene_is_kept_between_frames_and_forms),
        cmocka_unit_test(a_pane_to_its_horizon_has_its_points_in_the_scene),
        cmocka_unit_test(linked_light_lists_are_refused),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

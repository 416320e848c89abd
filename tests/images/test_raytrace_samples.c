/* SPDX-License-Identifier: MIT */
/* Four samples: edges of shadows and of highlights are antialiased, of ray tracing those inside of
 * meshes, too, and what is one plane in one light costs one shading. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { WIDTH = 160, HEIGHT = 120 };

static void add_lamp(struct glb_builder *builder, const double eye[3], double intensity)
{
    struct glb_node_desc node = {
        .light = glb_builder_add_light(builder, &(struct glb_light_desc){.type = GLB_LIGHT_SPOT,
                                                                         .intensity = intensity,
                                                                         .outer_cone_deg = 40})};
    glb_node_look_at(&node, eye, (double[]){0, 0, 0});
    glb_builder_add_node(builder, &node);
}

static void finish(struct glb_builder *builder, struct rig_scene *rig, struct renderer *renderer,
                   const char *key)
{
    struct error err = {0};
    size_t size_bytes;
    void *glb;
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, key, glb, size_bytes);
    free(glb);
}

static int add_material(struct glb_builder *builder)
{
    return glb_builder_add_material(
        builder, &(struct glb_material_desc){
                     .base_color = {0.7, 0.65, 0.6, 1}, .metallic = 0.4, .roughness = 0.25});
}

/* Fins, thin plates and shiny spheres, one mesh: what lies in front of what is of one surface as
 * far as meshes tell. */
static void open_fins(struct rig_scene *rig, struct renderer *renderer)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Fins", &err);
    struct shape shape = {0};
    shape_add_box(&shape, (double[]){-3, -0.1, -3}, (double[]){3, 0, 3});
    for (int i = 0; i < 24; i++)
        shape_add_box(&shape, (double[]){-2.2 + 0.12 * i, 0, -1.5},
                      (double[]){-2.16 + 0.12 * i, 0.8, -0.3});
    for (int i = 0; i < 14; i++)
        shape_add_box(&shape, (double[]){-2, 0.1 + 0.06 * i, 0.6},
                      (double[]){-0.6, 0.12 + 0.06 * i, 1.8});
    for (int i = 0; i < 5; i++)
        shape_add_sphere(&shape, (double[]){0.9 + 0.45 * (i % 3), 0.25, -1 + 0.6 * i}, 0.25, 48,
                         24);
    int mesh = shape_give_mesh(&shape, builder, "Fins", add_material(builder));
    glb_builder_add_node(builder, &(struct glb_node_desc){.mesh = mesh});
    add_lamp(builder, (double[]){3, 5, 2}, 90);
    add_lamp(builder, (double[]){-4, 3.5, 3}, 60);
    finish(builder, rig, renderer, "fins");
}

static struct view look(const double eye[3], const double target[3], enum shadow_technique shadows)
{
    struct view view = {.width_px = WIDTH,
                        .height_px = HEIGHT,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .fov_y_deg = 40},
                        .quality = {.shadows = shadows, .samples = 4}};
    memcpy(view.camera.eye, eye, sizeof view.camera.eye);
    memcpy(view.camera.target, target, sizeof view.camera.target);
    return view;
}

/* Of what a screen shows: cut at 1, so that no highlight outweighs a picture. */
static double rmse(const struct image *image, const struct image *reference)
{
    double sum = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const float *a = image_pixel_f32(image, i % WIDTH, i / WIDTH);
        const float *b = image_pixel_f32(reference, i % WIDTH, i / WIDTH);
        for (int k = 0; k < 3; k++) {
            double off = fmin((double)a[k], 1) - fmin((double)b[k], 1);
            sum += off * off;
        }
    }
    return sqrt(sum / (3.0 * WIDTH * HEIGHT));
}

/* once: the error of deep maps where each surface of a pixel is shaded once, as it was measured. */
static void expect_better_than_once(struct renderer *renderer, const struct rig_scene *rig,
                                    struct view view, const char *what, double once)
{
    struct view exact = view;
    exact.quality = (struct view_quality){.reference = true, .samples = 64};
    struct image reference = shoot_color(renderer, rig, &exact);
    static const enum shadow_technique forms[] = {SHADOWS_RAYTRACED, SHADOWS_DEEP};
    static const char *const names[] = {"raytraced", "deep"};
    for (int i = 0; i < 2; i++) {
        view.quality.shadows = forms[i];
        struct image image = shoot_color(renderer, rig, &view);
        double error = rmse(&image, &reference);
        image_finish(&image);
        print_message("%s: %s %.5f of %.5f\n", what, names[i], error, once);
        assert_true(error > 0 && error < 0.85 * once);
    }
    image_finish(&reference);
}

static void fins_are_better_than_shaded_once(void **state)
{
    struct rig_scene rig;
    open_fins(&rig, *state);
    expect_better_than_once(*state, &rig, look((double[]){2.5, 3, 5}, (double[]){0, 0.3, 0}, 0),
                            "fins", 0.01493);
    rig_scene_finish(&rig, *state);
}

static void the_demo_is_better_than_shaded_once(void **state)
{
    struct rig_scene rig;
    rig_demo_open_fine(&rig, *state, "demo", 64);
    expect_better_than_once(*state, &rig, look((double[]){3, 4.5, 3}, (double[]){0, 1.5, 0}, 0),
                            "demo", 0.01313);
    rig_scene_finish(&rig, *state);
}

static void an_engine_is_better_than_shaded_once(void **state)
{
    struct rig_scene rig;
    struct view view = look((double[]){0, 0, 1}, (double[]){0, 0, 0}, 0);
    if (!assets_are_present())
        skip();
    rig_asset_open(&rig, *state, "2CylinderEngine/2CylinderEngine.glb");
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_FIT, .fit = VIEW_FIT_ISO};
    /* no map: the grain of its samples would be most of the error */
    const struct view_light key = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {-0.45, -0.75, -0.48},
                                   .color = {1, 1, 1},
                                   .intensity = 2.2f};
    view.lights = &key;
    view.light_count = 1;
    view.has_environment = true;
    for (int k = 0; k < 3; k++)
        view.sky[k] = 0.45f, view.ground[k] = 0.2f;
    expect_better_than_once(*state, &rig, view, "engine", 0.01745);
    rig_scene_finish(&rig, *state);
}

static uint64_t count_rays(struct renderer *renderer, const struct rig_scene *rig, int samples)
{
    struct frame frame;
    struct view view = look((double[]){0, 3, 0.5}, (double[]){0, 0, 0}, SHADOWS_RAYTRACED);
    view.quality.samples = samples;
    shoot(renderer, rig, &view, &frame);
    uint64_t rays = frame.report.counts.shadow_rays;
    frame_finish(&frame);
    return rays;
}

/* Cut into cells: triangles of one plane are one surface. */
static void a_plane_in_one_light_is_shaded_once_a_pixel(void **state)
{
    struct rig_scene rig;
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Plane", &err);
    struct shape shape = {0};
    shape_add_grid(&shape, (double[]){-9, 0, 9}, (double[]){18, 0, 0}, (double[]){0, 0, -18}, 50,
                   50);
    int mesh = shape_give_mesh(&shape, builder, "Plane", add_material(builder));
    glb_builder_add_node(builder, &(struct glb_node_desc){.mesh = mesh});
    add_lamp(builder, (double[]){3, 9, 2}, 90);
    finish(builder, &rig, *state, "plane");
    assert_int_equal(WIDTH * HEIGHT, count_rays(*state, &rig, 1));
    assert_int_equal(WIDTH * HEIGHT, count_rays(*state, &rig, 4));
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fins_are_better_than_shaded_once),
        cmocka_unit_test(the_demo_is_better_than_shaded_once),
        cmocka_unit_test(an_engine_is_better_than_shaded_once),
        cmocka_unit_test(a_plane_in_one_light_is_shaded_once_a_pixel),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

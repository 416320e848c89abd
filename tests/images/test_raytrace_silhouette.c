/* SPDX-License-Identifier: MIT */
/* Blocks of the picture whose rays are not traced: nothing is met there, and the picture has the
 * bits that it has when they are. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/raytrace/rt_silhouette.h"
#include "renderer/scene/camera.h"
#include "tests/support/boxes.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/import_support.h"
#include "tests/support/render_support.h"

enum { WIDTH_PX = 90, HEIGHT_PX = 62, CAMERAS = 60, BOXES = 14 };

/* ---- no ray of a clear block meets anything ---- */

/* Boxes here and there, some of them media that a camera may be in. */
static void build_boxes(struct closed_form_scene *scene, uint64_t *seed, bool has_media)
{
    struct glb_builder *builder = closed_form_begin(scene, "Boxes", 0);
    for (int i = 0; i < BOXES; i++) {
        double low[3], high[3];
        struct glb_material_desc material = {
            .name = "Stone", .base_color = {1, 1, 1, 1}, .is_double_sided = true};
        if (has_media && i % 3 == 0)
            material = (struct glb_material_desc){.name = "Medium",
                                                  .base_color = {1, 1, 1, 1},
                                                  .transmission = 1,
                                                  .has_ior = true,
                                                  .ior = 1,
                                                  .thickness = 1,
                                                  .attenuation_distance = 1,
                                                  .attenuation_color = {0.5, 0.6, 0.7}};
        for (int k = 0; k < 3; k++) {
            double middle = closed_form_random(seed, -4, 4);
            double half = closed_form_random(seed, 0.02, i ? 0.5 : 2);
            low[k] = middle - half;
            high[k] = middle + half;
        }
        builder_add_box(builder, &material, low, high);
    }
    closed_form_end(scene, builder);
}

static struct view random_view(uint64_t *seed, int number)
{
    struct view view = {
        .width_px = WIDTH_PX, .height_px = HEIGHT_PX, .camera = {.kind = VIEW_CAMERA_LOOK_AT}};
    double reach = number % 4 ? 6 : 60;
    for (int k = 0; k < 3; k++) {
        view.camera.eye[k] = closed_form_random(seed, -reach, reach);
        view.camera.target[k] = closed_form_random(seed, -3, 3);
    }
    view.camera.fov_y_deg = number % 4 ? closed_form_random(seed, 20, 150) : 6;
    if (number % 5 == 1)
        view.camera.ortho_height = closed_form_random(seed, 1, 12);
    if (number % 7 == 2)
        view.tile = (struct view_tile){.x_px = 21, .y_px = 17, .width_px = 40, .height_px = 30};
    return view;
}

/* Returns how many pixels are clear. */
static int check_pixels(const struct rt_job *job, const struct rt_silhouette *silhouette)
{
    enum { RAYS = 5 };
    static const double places[RAYS][2] = {
        {0.5, 0.5}, {0.02, 0.02}, {0.98, 0.02}, {0.02, 0.98}, {0.98, 0.98}};
    struct rt_hits hits;
    struct error err = {0};
    int clear = 0;
    assert_true(rt_hits_init(&hits, &err));
    for (int y = job->tile.y_px; y < job->tile.y_px + job->tile.height_px; y++)
        for (int x = job->tile.x_px; x < job->tile.x_px + job->tile.width_px; x++) {
            if (!rt_silhouette_is_clear(silhouette, x, y))
                continue;
            clear++;
            for (int i = 0; i < RAYS; i++) {
                struct rt_ray ray;
                rt_job_camera_ray(job, x + places[i][0], y + places[i][1], &ray);
                rt_scene_collect(job->scene, &ray, &hits);
                if (hits.count)
                    fail_msg("a ray through %d, %d of a clear block meets %zu surfaces", x, y,
                             hits.count);
            }
        }
    rt_hits_finish(&hits);
    return clear;
}

static int check_view(const struct imported_scene *imported, const struct view *view)
{
    struct scene_state state;
    struct camera camera;
    struct rt_scene scene = {0};
    struct rt_silhouette silhouette;
    struct error err = {0};
    assert_true(scene_state_init(&state, &imported->scene, view, &err));
    assert_true(camera_resolve(&camera, view, &state, &err));
    assert_true(rt_scene_init(&scene, &state, view, &err));
    struct raytrace_desc desc = {.view = view, .state = &state, .camera = &camera};
    struct rt_job job = {.desc = &desc, .scene = &scene, .tile = view_tile_of(view)};
    assert_true(rt_silhouette_init(&silhouette, &job, &job.tile, &err));
    int clear = check_pixels(&job, &silhouette);
    rt_silhouette_finish(&silhouette);
    rt_scene_finish(&scene);
    scene_state_finish(&state);
    return clear;
}

static void no_ray_of_a_clear_block_meets_anything(void **unused)
{
    (void)unused;
    int clear = 0, views_with_clear = 0;
    for (int round = 0; round < CAMERAS; round++) {
        uint64_t seed = 77 + (uint64_t)round;
        struct closed_form_scene scene;
        struct imported_scene imported;
        struct error err = {0};
        build_boxes(&scene, &seed, round % 2);
        struct scene_file file = {.name = "", .bytes = scene.glb, .size_bytes = scene.size_bytes};
        assert_true(imported_scene_init(&imported, &file, 1, &err));
        struct view view = random_view(&seed, round);
        int found = check_view(&imported, &view);
        clear += found;
        views_with_clear += found > 0;
        imported_scene_finish(&imported);
        closed_form_scene_finish(&scene);
    }
    print_message("%d clear pixels in %d of %d views\n", clear, views_with_clear, CAMERAS);
    assert_true(views_with_clear > CAMERAS / 4);
}

/* A box that ends at the camera's feet covers what lies beside and behind it, too. */
static void a_box_around_the_eye_is_everywhere(void **unused)
{
    (void)unused;
    struct closed_form_scene scene;
    struct imported_scene imported;
    struct error err = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Hall", 0);
    builder_add_box(builder,
                    &(struct glb_material_desc){
                        .name = "Stone", .base_color = {1, 1, 1, 1}, .is_double_sided = true},
                    (const double[3]){-5, 0, -5}, (const double[3]){5, 4, 5});
    closed_form_end(&scene, builder);
    struct scene_file file = {.name = "", .bytes = scene.glb, .size_bytes = scene.size_bytes};
    assert_true(imported_scene_init(&imported, &file, 1, &err));
    struct view view = {
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {1, 2, 3}, .target = {-2, 1, 0}}};
    assert_int_equal(check_view(&imported, &view), 0);
    imported_scene_finish(&imported);
    closed_form_scene_finish(&scene);
}

/* ---- pictures ---- */

/* A sheet that looks away from the camera is not seen, but its box is before all pixels. What is
 * seen is unlit, since the sheet's shadow falls on what is lit. */
static void open_veiled(struct rig_scene *rig, struct renderer *renderer)
{
    static const struct glb_material_desc stone = {
        .name = "Stone", .base_color = {0.8, 0.6, 0.4, 1}, .is_unlit = true};
    struct closed_form_scene scene;
    struct error err = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Veiled", 0);
    builder_add_box(builder, &stone, (const double[3]){-3, 0, -3},
                    (const double[3]){-2.4, 0.7, -2});
    builder_add_box(builder, &stone, (const double[3]){1, 1, -1},
                    (const double[3]){1.3, 1.4, -0.6});
    builder_add_box(builder, &stone, (const double[3]){2.9, 1.9, 3}, (const double[3]){3, 2, 3.2});
    int material = glb_builder_add_material(
        builder, &(struct glb_material_desc){.name = "Veil", .base_color = {1, 1, 1, 1}});
    closed_form_quad(builder, "Veil", material, (const double[3]){-1, 0, 2.4},
                     (const double[3]){0, 2, 0}, (const double[3]){2, 0, 0});
    closed_form_end(&scene, builder);
    if (!rig_scene_from_glb(rig, renderer, "veiled", scene.glb, scene.size_bytes, &err))
        fail_msg("%s", err.message);
    closed_form_scene_finish(&scene);
}

static struct image shoot(struct renderer *renderer, const struct rig_scene *rig,
                          const struct view *view)
{
    struct frame frame;
    struct error err = {0};
    if (!renderer_render(renderer, rig->key, view, &frame, &err))
        fail_msg("%s", err.message);
    struct image color = frame.outputs[VIEW_OUTPUT_COLOR];
    frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
    frame_finish(&frame);
    return color;
}

static void compare_with_veil(struct renderer *renderer, const struct rig_scene *rig,
                              struct view *view, const char *name)
{
    static const struct view_node_override gone = {.node = "Veil", .has_visible = true};
    struct image veiled = shoot(renderer, rig, view);
    view->nodes = &gone;
    view->node_override_count = 1;
    struct image bare = shoot(renderer, rig, view);
    view->node_override_count = 0;
    save_picture(&bare, name);
    assert_int_equal(image_size_bytes(&bare), image_size_bytes(&veiled));
    if (memcmp(bare.pixels, veiled.pixels, image_size_bytes(&bare)) != 0)
        fail_msg("%s: the picture has other bits where rays are not traced", name);
    image_finish(&veiled);
    image_finish(&bare);
}

static struct view look(const struct view_light *lamp)
{
    return (struct view){
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 1, 2.9}, .target = {0, 1, 0}},
        .lights = lamp,
        .light_count = 1,
        .background = {0.1f, 0.2f, 0.3f, 0.5f},
        .quality = {.shadows = SHADOWS_RAYTRACED}};
}

static void pictures_keep_their_bits(void **state)
{
    static const struct view_light lamp = {.type = SCENE_LIGHT_POINT,
                                           .position = {0, 3, 0},
                                           .color = {1, 1, 1},
                                           .intensity = 40,
                                           .casts_no_shadow = true};
    struct rig_scene rig;
    open_veiled(&rig, *state);
    for (int samples = 1; samples <= 16; samples *= 4) {
        struct view view = look(&lamp);
        view.quality.samples = samples;
        compare_with_veil(*state, &rig, &view, "silhouette_colour");
        view.tile = (struct view_tile){.x_px = 13, .y_px = 7, .width_px = 50, .height_px = 49};
        compare_with_veil(*state, &rig, &view, "silhouette_tile");
        view = look(&lamp);
        view.quality.samples = samples;
        view.atmosphere = (struct view_atmosphere){.density_per_m = 0.1, .color = {1, 1, 1}};
        compare_with_veil(*state, &rig, &view, "silhouette_haze");
        view = look(&lamp);
        view.quality.samples = samples;
        view.environment_key = VIEW_STUDIO_KEY;
        view.environment_intensity = 1;
        view.environment_is_background = true;
        view.light_count = 0;
        compare_with_veil(*state, &rig, &view, "silhouette_studio");
        view.environment_is_background = false;
        view.screen.has_backdrop = true;
        compare_with_veil(*state, &rig, &view, "silhouette_backdrop");
    }
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_ray_of_a_clear_block_meets_anything),
        cmocka_unit_test(a_box_around_the_eye_is_everywhere),
        cmocka_unit_test(pictures_keep_their_bits),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Spheres in an environment: the rasterised ones, lit by means over their lobes, beside those of
 * the reference, which sees every direction (section 7 of docs/explanation/shading.md). */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { SIZE = 48 };

/* most: of the mean absolute error over the mean, of the whole picture. What one lobe mirrors is
 * taken from a lobe seen along its normal, which is far off where metals and fibres are seen at
 * grazing angles. */
static const struct {
    const char *name;
    double most;
    struct glb_material_desc material;
} balls[] = {
    {"diffuse",
     0.02,
     {.base_color = {0.8, 0.5, 0.2, 1}, .roughness = 1, .has_ior = true, .ior = 1}},
    {"plastic", 0.03, {.base_color = {0.6, 0.1, 0.1, 1}, .roughness = 0.4}},
    {"mirror", 0.08, {.base_color = {0.9, 0.9, 0.9, 1}, .metallic = 1, .roughness = 0.05}},
    {"gold", 0.15, {.base_color = {0.9, 0.7, 0.3, 1}, .metallic = 1, .roughness = 0.3}},
    {"iron", 0.15, {.base_color = {0.6, 0.6, 0.6, 1}, .metallic = 1, .roughness = 0.8}},
    {"lacquer",
     0.03,
     {.base_color = {0.1, 0.1, 0.6, 1},
      .roughness = 0.7,
      .clearcoat = 1,
      .clearcoat_roughness = 0.1}},
    {"velvet",
     0.17,
     {.base_color = {0.1, 0.02, 0.1, 1},
      .roughness = 0.9,
      .sheen_color = {0.9, 0.4, 0.6},
      .sheen_roughness = 0.4}},
    {"glass", 0.04, {.base_color = {0.7, 0.9, 0.8, 1}, .roughness = 0.1, .transmission = 1}},
};
enum { BALLS = sizeof balls / sizeof *balls };

static void open_ball(struct rig_scene *rig, struct renderer *renderer, int i)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Ball", &err);
    struct shape shape = {0};
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    shape_add_sphere(&shape, (double[]){0, 0, 0}, 1, 128, 64);
    int mesh = shape_give_mesh(&shape, builder, "Ball",
                               glb_builder_add_material(builder, &balls[i].material));
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Ball", .mesh = mesh});
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, balls[i].name, glb, size_bytes);
    free(glb);
}

static struct view look(void)
{
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 1, 5}, .fov_y_deg = 26},
        .environment_key = VIEW_STUDIO_KEY,
        .environment_rotation_deg = 30,
        .environment_intensity = 1,
        .environment_is_background = true,
        .quality = {.samples = 1, .shadows = SHADOWS_DEEP},
    };
}

static void rasterised_spheres_are_near_the_reference(void **state)
{
    struct renderer *renderer = *state;
    for (int i = 0; i < BALLS; i++) {
        struct rig_scene rig;
        struct view view = look();
        open_ball(&rig, renderer, i);
        struct image drawn = shoot_color(renderer, &rig, &view);
        view.quality.shadows = SHADOWS_RAYTRACED;
        view.quality.reference = true;
        struct image traced = shoot_color(renderer, &rig, &view);
        char name[64];
        snprintf(name, sizeof name, "environment_%s_drawn", balls[i].name);
        save_picture(&drawn, name);
        snprintf(name, sizeof name, "environment_%s_traced", balls[i].name);
        save_picture(&traced, name);
        double off = mean_error(&drawn, &traced);
        print_message("%s: mean error %.4f\n", balls[i].name, off);
        assert_true(off <= balls[i].most);
        assert_image_is_sound(&drawn, 1e4);
        image_finish(&drawn);
        image_finish(&traced);
        rig_scene_finish(&rig, renderer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rasterised_spheres_are_near_the_reference),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Clearcoat, sheen and specular reflection: rasterised pictures of spheres equal those of the
 * reference, opaque and as glass, under a lamp and under the sky. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { SPHERES = 6, WIDTH = 384, HEIGHT = 64 };

static const struct glb_material_desc materials[SPHERES] = {
    {.base_color = {0.6, 0.1, 0.1, 1},
     .roughness = 0.7,
     .clearcoat = 1,
     .clearcoat_roughness = 0.2},
    {.base_color = {0.9, 0.7, 0.3, 1},
     .metallic = 1,
     .roughness = 0.6,
     .clearcoat = 0.5,
     .clearcoat_roughness = 0.4},
    {.base_color = {0.1, 0.1, 0.4, 1},
     .roughness = 0.9,
     .sheen_color = {0.9, 0.6, 0.3},
     .sheen_roughness = 0.4},
    {.base_color = {0.4, 0.4, 0.4, 1},
     .roughness = 0.4,
     .has_specular = true,
     .specular = 1,
     .specular_color = {4, 1, 0.2}},
    {.base_color = {0.5, 0.8, 0.6, 1},
     .roughness = 0.5,
     .transmission = 0.8,
     .clearcoat = 1,
     .clearcoat_roughness = 0.3,
     .has_specular = true,
     .specular = 0.5,
     .specular_color = {1, 1, 1}},
    {.base_color = {0.2, 0.6, 0.3, 0.5},
     .alpha_mode = GLB_BLEND,
     .roughness = 0.8,
     .sheen_color = {0.8, 0.8, 0.8},
     .sheen_roughness = 0.7,
     .clearcoat = 0.6,
     .clearcoat_roughness = 0.5},
};

static void open_row(struct rig_scene *rig, struct renderer *renderer)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Lobes", &err);
    struct shape shape = {0};
    size_t size_bytes;
    void *glb;
    for (int i = 0; i < SPHERES; i++) {
        struct glb_node_desc node = {.translation = {2.2 * i - 1.1 * (SPHERES - 1), 0, 0}};
        shape_add_sphere(&shape, (double[]){0, 0, 0}, 1, 64, 32);
        node.mesh = shape_give_mesh(&shape, builder, "Sphere",
                                    glb_builder_add_material(builder, &materials[i]));
        glb_builder_add_node(builder, &node);
    }
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "lobes", glb, size_bytes);
    free(glb);
}

static const struct view_light lamp = {
    .type = SCENE_LIGHT_POINT, .position = {1, 3, 5}, .color = {1, 1, 1}, .intensity = 90};

static struct view look(bool is_sky)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 20}, .ortho_height = 2.2},
        .lights = &lamp,
        .light_count = is_sky ? 0 : 1,
        .has_environment = is_sky,
        .sky = {1, 0.9, 0.8},
        .ground = {0.1, 0.2, 0.3},
        .quality = {.samples = 1, .shadows = SHADOWS_RAYTRACED_SHADOWS}};
}

/* The surfaces of the G-buffer have 8 and 16 bits, and silhouettes may fall on either side. */
static void pictures_equal_the_reference(void **state)
{
    struct rig_scene rig;
    open_row(&rig, *state);
    for (int is_sky = 0; is_sky < 2; is_sky++) {
        struct view view = look(is_sky);
        struct image drawn = shoot_color(*state, &rig, &view);
        view.quality.shadows = SHADOWS_RAYTRACED;
        view.quality.reference = true;
        struct image traced = shoot_color(*state, &rig, &view);
        save_picture(&drawn, is_sky ? "lobes_sky_drawn" : "lobes_lamp_drawn");
        save_picture(&traced, is_sky ? "lobes_sky_traced" : "lobes_lamp_traced");
        double share = image_share_differing(&drawn, &traced, 0.01, 0.05);
        print_message("%s: %.3f %% of pixels differ by more than 1 %%, mean error %.2g\n",
                      is_sky ? "sky" : "lamp", 100 * share, mean_error(&drawn, &traced));
        assert_true(share < 0.01);
        assert_image_is_sound(&drawn, 1e4);
        image_finish(&drawn);
        image_finish(&traced);
    }
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_equal_the_reference),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

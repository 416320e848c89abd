/* SPDX-License-Identifier: MIT */
/* Clearcoat, sheen and specular reflection: rasterised pictures of spheres equal those of the
 * reference, opaque and as glass, under a lamp and under the sky. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/image_checks.h"

static const double pi = 3.14159265358979323846;

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

static const struct glb_material_desc films[SPHERES] = {
    {.base_color = {0.05, 0.05, 0.05, 1}, .roughness = 0.35, .iridescence = 1, .film_most_nm = 420},
    {.base_color = {0.9, 0.7, 0.3, 1},
     .metallic = 1,
     .roughness = 0.4,
     .iridescence = 1,
     .iridescence_ior = 1.8,
     .film_most_nm = 250},
    {.base_color = {0.5, 0.2, 0.2, 1},
     .metallic = 0.5,
     .roughness = 0.5,
     .iridescence = 0.6,
     .iridescence_ior = 1.5,
     .film_most_nm = 800,
     .clearcoat = 0.7,
     .clearcoat_roughness = 0.4},
    {.base_color = {0.4, 0.4, 0.4, 1},
     .roughness = 0.4,
     .iridescence = 1,
     .iridescence_ior = 2,
     .film_most_nm = 300,
     .has_specular = true,
     .specular = 0.7,
     .specular_color = {4, 1, 0.2}},
    {.base_color = {0.9, 0.9, 0.9, 1},
     .roughness = 0.5,
     .transmission = 0.9,
     .iridescence = 1,
     .iridescence_ior = 1.33,
     .film_most_nm = 350},
    {.base_color = {0.2, 0.6, 0.3, 0.5},
     .alpha_mode = GLB_BLEND,
     .roughness = 0.6,
     .iridescence = 0.8,
     .iridescence_ior = 1.6,
     .film_most_nm = 550,
     .sheen_color = {0.5, 0.5, 0.5},
     .sheen_roughness = 0.7},
};

static const struct glb_material_desc grains[SPHERES] = {
    {.base_color = {0.8, 0.8, 0.8, 1}, .metallic = 1, .roughness = 0.4, .anisotropy = 0.8},
    {.base_color = {0.8, 0.6, 0.3, 1},
     .metallic = 1,
     .roughness = 0.4,
     .anisotropy = 0.8,
     .anisotropy_rad = 1.2},
    {.base_color = {0.1, 0.1, 0.4, 1}, .roughness = 0.3, .anisotropy = 0.6, .anisotropy_rad = 3},
    {.base_color = {0.3, 0.3, 0.3, 1},
     .metallic = 1,
     .roughness = 0.45,
     .anisotropy = 0.5,
     .iridescence = 1,
     .film_most_nm = 500},
    {.base_color = {0.5, 0.8, 0.6, 1},
     .roughness = 0.5,
     .transmission = 0.8,
     .anisotropy = 0.7,
     .anisotropy_rad = 0.5},
    {.base_color = {0.6, 0.6, 0.3, 0.5},
     .alpha_mode = GLB_BLEND,
     .roughness = 0.5,
     .anisotropy = 1,
     .clearcoat = 0.6,
     .clearcoat_roughness = 0.5},
};

static const struct glb_material_desc leaves[SPHERES] = {
    {.base_color = {0.2, 0.5, 0.1, 1},
     .roughness = 0.7,
     .is_double_sided = true,
     .diffuse_transmission = 0.5,
     .diffuse_transmission_color = {0.5, 0.9, 0.1}},
    {.base_color = {0.9, 0.9, 0.9, 1},
     .roughness = 0.5,
     .is_double_sided = true,
     .diffuse_transmission = 1,
     .diffuse_transmission_color = {1, 0.3, 0.2}},
    {.base_color = {0.9, 0.9, 0.9, 1},
     .roughness = 0.6,
     .metallic = 0.5,
     .is_double_sided = true,
     .diffuse_transmission = 0.8,
     .diffuse_transmission_color = {1, 1, 1},
     .iridescence = 1,
     .film_most_nm = 400},
    {.base_color = {0.3, 0.3, 0.8, 1},
     .roughness = 0.6,
     .is_double_sided = true,
     .diffuse_transmission = 0.7,
     .diffuse_transmission_color = {0.4, 0.4, 1},
     .clearcoat = 0.8,
     .clearcoat_roughness = 0.4,
     .sheen_color = {0.3, 0.3, 0.3},
     .sheen_roughness = 0.6},
    {.base_color = {0.5, 0.8, 0.6, 1},
     .roughness = 0.6,
     .is_double_sided = true,
     .transmission = 0.5,
     .diffuse_transmission = 0.6,
     .diffuse_transmission_color = {0.9, 0.6, 0.2}},
    {.base_color = {0.6, 0.6, 0.3, 0.6},
     .alpha_mode = GLB_BLEND,
     .roughness = 0.7,
     .is_double_sided = true,
     .diffuse_transmission = 0.6,
     .diffuse_transmission_color = {0.9, 0.9, 0.3}},
};

/* One picture for all: its channels differ, and its colours do as a normal map, too. */
static void add_textures(struct glb_builder *builder, struct glb_material_desc *material)
{
    enum { SIDE = 32 };
    uint8_t texels[SIDE * SIDE * 4], combs[SIDE * SIDE * 4];
    for (int i = 0; i < SIDE * SIDE; i++) {
        int x = i % SIDE, y = i / SIDE;
        double u = 2 * pi * x / SIDE, v = 2 * pi * y / SIDE;
        texels[4 * i] = (uint8_t)(128 + 30 * sin(u));
        texels[4 * i + 1] = (uint8_t)(128 + 30 * cos(v));
        texels[4 * i + 2] = (uint8_t)(200 + 50 * sin(u + v));
        texels[4 * i + 3] = (uint8_t)(180 + 60 * cos(u - v));
        combs[4 * i] = (uint8_t)(220 + 30 * cos(v)); /* a direction is never 0 */
        combs[4 * i + 1] = (uint8_t)(128 + 90 * sin(u));
        combs[4 * i + 2] = (uint8_t)(200 + 50 * sin(u + v));
        combs[4 * i + 3] = 255;
    }
    int image = glb_builder_add_image(builder, "Waves", texels, SIDE, SIDE);
    struct glb_texture_ref ref = {
        .texture = glb_builder_add_texture(
            builder, &(struct glb_texture_desc){.image = image, .filter = GLB_FILTER_LINEAR})};
    material->specular_texture = material->specular_color_texture = ref;
    material->clearcoat_texture = material->clearcoat_roughness_texture = ref;
    material->clearcoat_normal_texture = ref;
    material->sheen_color_texture = material->sheen_roughness_texture = ref;
    material->iridescence_texture = material->iridescence_thickness_texture = ref;
    material->diffuse_transmission_texture = material->diffuse_transmission_color_texture = ref;
    image = glb_builder_add_image(builder, "Combs", combs, SIDE, SIDE);
    ref.texture = glb_builder_add_texture(
        builder, &(struct glb_texture_desc){.image = image, .filter = GLB_FILTER_LINEAR});
    material->anisotropy_texture = ref;
}

/* A row of spheres. */
struct row {
    const char *name;
    const struct glb_material_desc *materials; /* SPHERES of them */
    bool is_textured;
    bool has_sheets; /* squares instead of spheres, with a second lamp behind them */
};

static void open_row(struct rig_scene *rig, struct renderer *renderer, const struct row *row)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Lobes", &err);
    struct shape shape = {0};
    size_t size_bytes;
    void *glb;
    for (int i = 0; i < SPHERES; i++) {
        struct glb_material_desc material = row->materials[i];
        if (row->is_textured)
            add_textures(builder, &material);
        struct glb_node_desc node = {.translation = {2.2 * i - 1.1 * (SPHERES - 1), 0, 0}};
        if (row->has_sheets)
            shape_add_quad(&shape, (double[]){-1, -1, 0}, (double[]){2, 0, 0}, (double[]){0, 2, 0});
        else
            shape_add_sphere(&shape, (double[]){0, 0, 0}, 1, 64, 32);
        node.mesh = shape_give_mesh(&shape, builder, "Sphere",
                                    glb_builder_add_material(builder, &material));
        glb_builder_add_node(builder, &node);
    }
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, row->name, glb, size_bytes);
    free(glb);
}

static const struct view_light lamps[] = {
    {.type = SCENE_LIGHT_POINT, .position = {1, 3, 5}, .color = {1, 1, 1}, .intensity = 90},
    {.type = SCENE_LIGHT_POINT, .position = {-1, 2, -6}, .color = {1, 1, 1}, .intensity = 190}};

static struct view look(bool is_sky, size_t lamp_count)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 20}, .ortho_height = 2.2},
        .lights = lamps,
        .light_count = is_sky ? 0 : lamp_count,
        .has_environment = is_sky,
        .sky = {1, 0.9, 0.8},
        .ground = {0.1, 0.2, 0.3},
        .quality = {.samples = 1,
                    .shadows = SHADOWS_RAYTRACED_SHADOWS,
                    .refraction = VIEW_REFRACTION_OFF}}; /* which has tests of its own */
}

/* The surfaces of the G-buffer have 8 and 16 bits, and silhouettes may fall on either side. */
static void compare(struct renderer *renderer, const struct row *row, int samples,
                    double share_most)
{
    struct rig_scene rig;
    open_row(&rig, renderer, row);
    for (int is_sky = 0; is_sky < 2; is_sky++) {
        struct view view = look(is_sky, row->has_sheets ? 2 : 1);
        view.quality.samples = samples;
        struct image drawn = shoot_color(renderer, &rig, &view);
        view.quality.shadows = SHADOWS_RAYTRACED;
        view.quality.reference = true;
        struct image traced = shoot_color(renderer, &rig, &view);
        char name[64];
        snprintf(name, sizeof name, "%s_%s_%d", row->name, is_sky ? "sky" : "lamp", samples);
        save_picture(&drawn, name);
        double share = image_share_differing(&drawn, &traced, 0.02, 0.05);
        print_message("%s: %.3f %% of pixels differ by more than 2 %%, mean error %.2g\n", name,
                      100 * share, mean_error(&drawn, &traced));
        assert_true(share < share_most);
        assert_image_is_sound(&drawn, 1e4);
        image_finish(&drawn);
        image_finish(&traced);
    }
    rig_scene_finish(&rig, renderer);
}

static void pictures_equal_the_reference(void **state)
{
    const struct row row = {.name = "lobes", .materials = materials};
    compare(*state, &row, 1, 0.002);
    compare(*state, &row, 4, 0.05); /* the silhouettes are 4.4 % of the pixels */
}

static void pictures_with_textures_equal_the_reference(void **state)
{
    const struct row row = {.name = "lobes_textured", .materials = materials, .is_textured = true};
    compare(*state, &row, 1, 0.03);
}

static void films_equal_the_reference(void **state)
{
    const struct row plain = {.name = "films", .materials = films};
    const struct row textured = {.name = "films_textured", .materials = films, .is_textured = true};
    compare(*state, &plain, 1, 0.002);
    compare(*state, &plain, 4, 0.06); /* beside the silhouettes films change by the pixel */
    compare(*state, &textured, 1, 0.03);
}

/* The frame of texture coordinates, as the spheres have no tangents: at the poles it turns within a
 * pixel. */
static void grains_equal_the_reference(void **state)
{
    const struct row plain = {.name = "grains", .materials = grains};
    const struct row textured = {
        .name = "grains_textured", .materials = grains, .is_textured = true};
    compare(*state, &plain, 1, 0.002);
    compare(*state, &plain, 4, 0.06);
    compare(*state, &textured, 1, 0.03);
}

/* Lit from both sides, through their own shadows: by rays, and by maps. */
static void leaves_equal_the_reference(void **state)
{
    const struct row plain = {"leaves", leaves, false, true};
    const struct row textured = {"leaves_textured", leaves, true, true};
    compare(*state, &plain, 1, 0.002);
    compare(*state, &plain, 4, 0.06);
    compare(*state, &textured, 1, 0.03);
}

static void leaves_let_light_through_under_every_map(void **state)
{
    static const enum shadow_technique techniques[] = {SHADOWS_MAP, SHADOWS_DEEP};
    const struct row row = {"leaves", leaves, false, true};
    struct rig_scene rig;
    open_row(&rig, *state, &row);
    struct view view = look(false, 2);
    view.quality.reference = true;
    view.quality.shadows = SHADOWS_RAYTRACED;
    struct image traced = shoot_color(*state, &rig, &view);
    view.quality.reference = false;
    for (int i = 0; i < 2; i++) {
        view.quality.shadows = techniques[i];
        struct image drawn = shoot_color(*state, &rig, &view);
        double share = image_share_differing(&drawn, &traced, 0.02, 0.05);
        print_message("%d: %.3f %% of pixels differ\n", (int)techniques[i], 100 * share);
        assert_true(share < 0.002);
        image_finish(&drawn);
    }
    image_finish(&traced);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_equal_the_reference),
        cmocka_unit_test(pictures_with_textures_equal_the_reference),
        cmocka_unit_test(films_equal_the_reference),
        cmocka_unit_test(grains_equal_the_reference),
        cmocka_unit_test(leaves_equal_the_reference),
        cmocka_unit_test(leaves_let_light_through_under_every_map),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Light of an environment on surfaces: closed forms of the irradiance, through coloured glass, in a
 * closed room and in a furnace (section 7 of docs/explanation/shading.md). */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { SIZE = 32, MAP_WIDTH = 64, MAP_HEIGHT = 32 };

static const double tint[3] = {0.9, 0.5, 0.25}, grey[3] = {0.8, 0.4, 0.2};

/* Of a diffuse surface that reflects nothing else. */
static struct glb_material_desc diffuse(const double color[3])
{
    return (struct glb_material_desc){.name = "Diffuse",
                                      .base_color = {color[0], color[1], color[2], 1},
                                      .is_double_sided = true,
                                      .roughness = 1,
                                      .has_ior = true,
                                      .ior = 1};
}

static void attach_map(struct renderer *renderer, bool is_half, struct environment **map)
{
    float pixels[3 * MAP_WIDTH * MAP_HEIGHT];
    struct error err = {0};
    for (int i = 0; i < 3 * MAP_WIDTH * MAP_HEIGHT; i++)
        pixels[i] = !is_half || i < 3 * MAP_WIDTH * MAP_HEIGHT / 2 ? 1 : 0;
    *map = environment_create(&(struct environment_desc){pixels, MAP_WIDTH, MAP_HEIGHT}, &err);
    assert_non_null(*map);
    const struct renderer_environment_desc desc = {.key = "map", .environment = *map};
    assert_true(renderer_attach_environment(renderer, &desc, &err));
}

static void detach_map(struct renderer *renderer, struct environment *map)
{
    renderer_detach_environment(renderer, "map");
    environment_destroy(map);
}

static void finish(struct glb_builder *builder, struct rig_scene *rig, struct renderer *renderer,
                   const char *key)
{
    struct error err = {0};
    void *glb;
    size_t size_bytes;
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, key, glb, size_bytes);
    free(glb);
}

static void give(struct shape *shape, struct glb_builder *builder,
                 const struct glb_material_desc *material)
{
    int mesh = shape_give_mesh(shape, builder, material->name,
                               glb_builder_add_material(builder, material));
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = material->name, .mesh = mesh});
}

enum roof { ROOF_NONE, ROOF_PANE, ROOF_OPAQUE };

/* Floor and four walls, 2 m a side, under a roof. */
static void open_room(struct rig_scene *rig, struct renderer *renderer, enum roof roof)
{
    static const char *const keys[] = {"open", "pane", "closed"};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Room", &err);
    struct shape shape = {0};
    const struct glb_material_desc wall = diffuse(grey);
    struct glb_material_desc pane = diffuse(tint);
    assert_non_null(builder);
    pane.name = "Pane";
    pane.transmission = 1;
    const double low = -1, size = 2;
    shape_add_quad(&shape, (double[]){low, 0, low}, (double[]){0, 0, size}, (double[]){size, 0, 0});
    for (int side = 0; side < 4; side++) {
        double at = side % 2 ? low : low + size;
        double corner[3] = {side < 2 ? at : low, 0, side < 2 ? low : at};
        double along[3] = {side < 2 ? 0 : size, 0, side < 2 ? size : 0};
        shape_add_quad(&shape, corner, along, (double[]){0, size, 0});
    }
    if (roof == ROOF_OPAQUE)
        shape_add_quad(&shape, (double[]){low, size, low}, (double[]){0, 0, size},
                       (double[]){size, 0, 0});
    give(&shape, builder, &wall);
    if (roof == ROOF_PANE) {
        shape_add_quad(&shape, (double[]){low, size, low}, (double[]){0, 0, size},
                       (double[]){size, 0, 0});
        give(&shape, builder, &pane);
    }
    finish(builder, rig, renderer, keys[roof]);
}

static struct view look(bool is_reference)
{
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 1.8, 0}, .up = {0, 0, -1}},
        .environment_key = "map",
        .environment_intensity = 1,
        .quality = {.shadows = SHADOWS_RAYTRACED, .samples = 1, .reference = is_reference},
    };
}

/* With equal samples the ratio is the filter's, to the rounding of f32. */
static void glass_colours_the_sky_and_a_closed_room_is_dark(void **state)
{
    struct renderer *renderer = *state;
    struct environment *map;
    struct rig_scene rooms[3];
    attach_map(renderer, false, &map);
    for (int roof = 0; roof < 3; roof++)
        open_room(&rooms[roof], renderer, (enum roof)roof);
    for (int is_reference = 0; is_reference < 2; is_reference++) {
        struct image images[3];
        struct view view = look(is_reference);
        view.quality.environment_samples = 256;
        for (int roof = 0; roof < 3; roof++)
            images[roof] = shoot_color(renderer, &rooms[roof], &view);
        for (int i = 0; i < SIZE * SIZE; i++) {
            const float *bare = image_pixel_f32(&images[ROOF_NONE], i % SIZE, i / SIZE);
            const float *glazed = image_pixel_f32(&images[ROOF_PANE], i % SIZE, i / SIZE);
            const float *dark = image_pixel_f32(&images[ROOF_OPAQUE], i % SIZE, i / SIZE);
            assert_true(bare[0] > 0.05F);
            for (int k = 0; k < 3; k++) {
                assert_true(fabs((double)(glazed[k] / bare[k]) - tint[k]) <= 1e-5);
                assert_true(dark[k] == 0);
            }
        }
        for (int roof = 0; roof < 3; roof++)
            image_finish(&images[roof]);
    }
    for (int roof = 0; roof < 3; roof++)
        rig_scene_finish(&rooms[roof], renderer);
    detach_map(renderer, map);
}

/* How rasterised pictures come to light and shadow beside the map's. */
static const struct {
    const char *name;
    enum shadow_technique shadows;
    int samples;
    bool has_lamp; /* so dark that it is not seen */
} rasterised[] = {
    {"no light", SHADOWS_NONE, 1, false},
    {"no light, antialiased", SHADOWS_NONE, 4, false},
    {"deep", SHADOWS_DEEP, 1, true},
    {"deep, antialiased", SHADOWS_DEEP, 4, true},
    {"traced shadows", SHADOWS_RAYTRACED_SHADOWS, 1, true},
    {"traced shadows, antialiased", SHADOWS_RAYTRACED_SHADOWS, 4, true},
};

static double mean_of(const struct image *image)
{
    double mean[3];
    image_mean(image, (double[]){0, 0, 1, 1}, mean);
    return mean[0] + mean[1] + mean[2];
}

/* The same of rasterised pictures whose environment is seen by rays; without rays the closed room
 * is as bright as under the open sky. The open room is as the reference has it. */
static void rasterised_rooms_are_lit_through_their_roofs(void **state)
{
    struct renderer *renderer = *state;
    static const struct view_light lamp = {
        .type = SCENE_LIGHT_POINT, .position = {0, 1, 0}, .color = {1, 1, 1}, .intensity = 1e-12F};
    struct environment *map;
    struct rig_scene rooms[3];
    attach_map(renderer, true, &map);
    for (int roof = 0; roof < 3; roof++)
        open_room(&rooms[roof], renderer, (enum roof)roof);
    struct view exact = look(true);
    exact.quality.environment_samples = 1024;
    struct image reference = shoot_color(renderer, &rooms[ROOF_NONE], &exact);
    for (size_t i = 0; i < sizeof rasterised / sizeof *rasterised; i++) {
        struct image images[4];
        struct view view = look(false);
        view.quality = (struct view_quality){.shadows = rasterised[i].shadows,
                                             .samples = rasterised[i].samples,
                                             .environment_samples = 256,
                                             .environment_visibility = VIEW_VISIBILITY_RAYS};
        view.lights = &lamp;
        view.light_count = rasterised[i].has_lamp;
        for (int roof = 0; roof < 3; roof++)
            images[roof] = shoot_color(renderer, &rooms[roof], &view);
        view.quality.environment_visibility = VIEW_VISIBILITY_NONE;
        images[3] = shoot_color(renderer, &rooms[ROOF_OPAQUE], &view);
        double worst = 0, brightness = mean_of(&images[ROOF_NONE]) / mean_of(&reference);
        for (int p = 0; p < SIZE * SIZE; p++) {
            const float *bare = image_pixel_f32(&images[ROOF_NONE], p % SIZE, p / SIZE);
            const float *glazed = image_pixel_f32(&images[ROOF_PANE], p % SIZE, p / SIZE);
            const float *dark = image_pixel_f32(&images[ROOF_OPAQUE], p % SIZE, p / SIZE);
            const float *lit = image_pixel_f32(&images[3], p % SIZE, p / SIZE);
            for (int k = 0; k < 3; k++) {
                worst = fmax(worst, fabs((double)(glazed[k] / bare[k]) - tint[k]));
                assert_true((double)dark[k] < 1e-9);
                assert_true((double)lit[k] > 0.15);
            }
        }
        print_message("%s: glass off by %.1e, brightness %.4f of the reference's\n",
                      rasterised[i].name, worst, brightness);
        assert_true(worst <= 2e-5);
        assert_true(fabs(brightness - 1) <= 0.01);
        for (int roof = 0; roof < 4; roof++)
            image_finish(&images[roof]);
    }
    image_finish(&reference);
    for (int roof = 0; roof < 3; roof++)
        rig_scene_finish(&rooms[roof], renderer);
    detach_map(renderer, map);
}

/* A floor and a wall far from each other, seen one at a time. */
static void open_planes(struct rig_scene *rig, struct renderer *renderer)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Planes", &err);
    struct shape shape = {0};
    const struct glb_material_desc material = diffuse(grey);
    assert_non_null(builder);
    shape_add_quad(&shape, (double[]){-1, 0, 1}, (double[]){2, 0, 0}, (double[]){0, 0, -2});
    shape_add_quad(&shape, (double[]){999, -1, 0}, (double[]){2, 0, 0}, (double[]){0, 2, 0});
    give(&shape, builder, &material);
    finish(builder, rig, renderer, "planes");
}

static void expect_mean(struct renderer *renderer, const struct rig_scene *rig,
                        const struct view *view, double irradiance_over_pi, double tolerance)
{
    struct image image = shoot_color(renderer, rig, view);
    double mean[3];
    image_mean(&image, (double[]){0, 0, 1, 1}, mean);
    for (int k = 0; k < 3; k++)
        if (!(fabs(mean[k] / (irradiance_over_pi * grey[k]) - 1) <= tolerance))
            fail_msg("mean %.8g, expected %.8g", mean[k], irradiance_over_pi * grey[k]);
    image_finish(&image);
}

/* E = pi L on the floor and half of that on the wall. The row below the horizon's texels lies
 * half in the gradient between white and black: its share is within the tolerance. */
static void a_half_white_sky_lights_floors_fully_and_walls_by_half(void **state)
{
    struct renderer *renderer = *state;
    struct environment *map;
    struct rig_scene rig;
    attach_map(renderer, true, &map);
    open_planes(&rig, renderer);
    for (int is_reference = 0; is_reference < 2; is_reference++) {
        struct view view = look(is_reference);
        view.environment_intensity = 3;
        view.environment_rotation_deg = -100;
        view.quality.environment_samples = 1024;
        view.camera.ortho_height = 1.5;
        expect_mean(renderer, &rig, &view, 3, 0.003);
        view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                           .eye = {1000, 0, 3},
                                           .target = {1000, 0, 0},
                                           .ortho_height = 1.5};
        expect_mean(renderer, &rig, &view, 1.5, 0.003);
    }
    rig_scene_finish(&rig, renderer);
    detach_map(renderer, map);
}

/* A leaf under a sky that is white above the horizon, seen from below: what it shows is the light
 * of the other side, share * color * L. A lid over it, seen by rays, leaves nothing. */
static void a_leaf_shows_the_sky_behind_it(void **state)
{
    struct renderer *renderer = *state;
    static const double share = 0.6, color[3] = {0.4, 0.8, 0.2}; /* of 8 bits */
    struct environment *map;
    attach_map(renderer, true, &map);
    for (int has_lid = 0; has_lid < 2; has_lid++) {
        struct rig_scene rig;
        struct error err = {0};
        struct glb_builder *builder = glb_builder_create("Leaf", &err);
        struct shape shape = {0};
        struct glb_material_desc leaf = diffuse(grey), lid = diffuse(grey);
        assert_non_null(builder);
        lid.name = "Lid";
        leaf.diffuse_transmission = share;
        memcpy(leaf.diffuse_transmission_color, color, sizeof color);
        shape_add_quad(&shape, (double[]){-1, 0, 1}, (double[]){2, 0, 0}, (double[]){0, 0, -2});
        give(&shape, builder, &leaf);
        shape_add_quad(&shape, (double[]){-1e3, 1, 1e3}, (double[]){2e3, 0, 0},
                       (double[]){0, 0, -2e3});
        if (has_lid)
            give(&shape, builder, &lid);
        finish(builder, &rig, renderer, has_lid ? "leaf under a lid" : "leaf");
        for (int form = 0; form < 4; form++) {
            struct view view = look(form == 1);
            view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                               .eye = {0, -2, 0},
                                               .up = {0, 0, -1},
                                               .ortho_height = 1.5};
            view.quality.environment_samples = 1024;
            if (form >= 2)
                view.quality.shadows = SHADOWS_DEEP;
            view.quality.environment_visibility =
                form == 3 ? VIEW_VISIBILITY_RAYS : VIEW_VISIBILITY_NONE;
            struct image image = shoot_color(renderer, &rig, &view);
            double mean[3];
            image_mean(&image, (double[]){0, 0, 1, 1}, mean);
            for (int k = 0; k < 3; k++) {
                double expected = has_lid && form != 2 ? 0 : share * color[k];
                if (!(fabs(mean[k] - expected) <= 0.004 * color[k]))
                    fail_msg("form %d, lid %d: mean %.8g, expected %.8g", form, has_lid, mean[k],
                             expected);
            }
            image_finish(&image);
        }
        shape_finish(&shape);
        rig_scene_finish(&rig, renderer);
    }
    detach_map(renderer, map);
}

static void open_sphere(struct rig_scene *rig, struct renderer *renderer, bool is_metal)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Sphere", &err);
    struct shape shape = {0};
    struct glb_material_desc material = diffuse((double[]){1, 1, 1});
    assert_non_null(builder);
    if (is_metal)
        material.metallic = 1, material.roughness = 0;
    shape_add_sphere(&shape, (double[]){0, 0, 0}, 1, 64, 32);
    give(&shape, builder, &material);
    finish(builder, rig, renderer, is_metal ? "metal" : "white");
}

/* White diffuse and mirroring spheres cannot be told from the sky behind them; but facets hide a
 * part of the sky at grazing angles, so that only the middle is looked at. */
static void a_white_sphere_vanishes_in_a_white_furnace(void **state)
{
    struct renderer *renderer = *state;
    struct environment *map;
    attach_map(renderer, false, &map);
    for (int i = 0; i < 4; i++) {
        const bool is_metal = i % 2, is_reference = i / 2;
        struct rig_scene rig;
        open_sphere(&rig, renderer, is_metal);
        struct view view = look(is_reference);
        view.camera = (struct view_camera){
            .kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 5}, .ortho_height = 2.2};
        view.environment_is_background = true;
        view.quality.environment_samples = 256;
        struct image image = shoot_color(renderer, &rig, &view);
        double worst = 0;
        for (int p = 0; p < SIZE * SIZE; p++) {
            int column = p % SIZE, row = p / SIZE;
            double x = (column + 0.5) / SIZE - 0.5, y = (row + 0.5) / SIZE - 0.5;
            double off = fabs((double)image_pixel_f32(&image, p % SIZE, p / SIZE)[0] - 1);
            if (x * x + y * y < 0.12 || x * x + y * y > 0.24)
                worst = fmax(worst, off);
        }
        print_message("%s, %s: off by %.4f\n", is_metal ? "metal" : "diffuse",
                      is_reference ? "reference" : "production", worst);
        assert_true(worst <= 0.02);
        image_finish(&image);
        rig_scene_finish(&rig, renderer);
    }
    detach_map(renderer, map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glass_colours_the_sky_and_a_closed_room_is_dark),
        cmocka_unit_test(rasterised_rooms_are_lit_through_their_roofs),
        cmocka_unit_test(a_half_white_sky_lights_floors_fully_and_walls_by_half),
        cmocka_unit_test(a_leaf_shows_the_sky_behind_it),
        cmocka_unit_test(a_white_sphere_vanishes_in_a_white_furnace),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

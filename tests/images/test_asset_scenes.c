/* SPDX-License-Identifier: MIT */
/* Whole scenes of others: a lamp with its own lights, a toy car, a chair, and Sponza under four
 * lights with curtains of coloured glass. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/asset_checks.h"

static double luminance(const double c[3])
{
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

static double share_of_hue(const struct image *color, const struct image *ids, uint32_t id,
                           const double least[3])
{
    size_t count = 0, hits = 0, pixels = (size_t)color->width_px * (size_t)color->height_px;
    for (size_t i = 0; i < pixels; i++) {
        const float *p = (const float *)color->pixels + 4 * i;
        double largest = (double)fmaxf(p[0], fmaxf(p[1], p[2]));
        if (((const uint32_t *)ids->pixels)[i] != id)
            continue;
        count++;
        bool is_hit = largest > 0;
        for (int c = 0; c < 3; c++) /* at least so much of the largest; negative: at most */
            is_hit = is_hit && (least[c] >= 0 ? (double)p[c] >= least[c] * largest
                                              : (double)p[c] <= -least[c] * largest);
        hits += is_hit;
    }
    return count ? (double)hits / (double)count : 0;
}

/* -- LightsPunctualLamp -- */

/* The lights of the scene as lights of a request. */
static void lights_of(const struct rig_scene *rig, struct view_light *lights, size_t count)
{
    const struct scene *scene = &rig->imported.scene;
    size_t n = 0;
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const struct scene_node *node = &scene->nodes[i];
        if (node->light < 0)
            continue;
        assert_true(n < count);
        const struct scene_light *light = &scene->lights[node->light];
        struct view_light *out = &lights[n++];
        *out = (struct view_light){.type = (enum scene_light_type)light->type,
                                   .intensity = light->intensity,
                                   .range = light->range};
        memcpy(out->color, light->color, sizeof out->color);
        memcpy(out->position, node->world_matrix + 12, sizeof out->position);
        for (int c = 0; c < 3; c++) {
            out->direction[c] = -node->world_matrix[8 + c];
            out->up[c] = node->world_matrix[4 + c];
        }
    }
    assert_int_equal(n, count);
}

static struct view lamp_view(void)
{
    return asset_view((double[]){0.6, 1.3, 4.2}, (double[]){0.25, 0.95, 0}, 28);
}

enum { LAMP = 1, LAMP_SHADE = 3 }; /* materials by position in the file, which names none */

static void lamp_is_lit_by_its_own_coloured_lights(void **state)
{
    struct rig_scene rig;
    struct frame frame, dark;
    double on[3], off[3];
    rig_asset_open(&rig, *state, "LightsPunctualLamp/glTF/LightsPunctualLamp.gltf");
    struct view view = lamp_view();
    view.quality.refraction = VIEW_REFRACTION_OFF; /* of which rasterised pictures warn */
    asset_shoot(*state, &rig, &view, "LightsPunctualLamp", &frame);
    assert_int_equal(frame.report.counts.lights, 5);
    assert_int_equal(frame.report.warning_count, 0);
    const struct image *color = &frame.outputs[VIEW_OUTPUT_COLOR],
                       *materials = &frame.outputs[VIEW_OUTPUT_MATERIAL];
    view.ignore_scene_lights = view.has_environment = true; /* a black one: nothing shines */
    shoot(*state, &rig, &view, &dark);
    assert_true(image_mean_of(color, materials, LAMP_SHADE, on) > 2000);
    image_mean_of(&dark.outputs[VIEW_OUTPUT_COLOR], materials, LAMP_SHADE, off);
    assert_true(luminance(on) > 1 && luminance(on) > 5 * luminance(off));
    assert_true(on[0] > 1.2 * on[2]); /* the bulb's orange light */
    /* Two lights are teal, two orange: both are found on the white metal. */
    double teal = share_of_hue(color, materials, LAMP, (double[]){-0.6, 0.8, 0.6});
    double orange = share_of_hue(color, materials, LAMP, (double[]){1, 0, -0.6});
    if (!(teal > 0.015 && orange > 0.1))
        fail_msg("%g of the stand is teal, %g orange", teal, orange);
    frame_finish(&frame);
    frame_finish(&dark);
    asset_check_invariants(*state, &rig, &view);
    rig_scene_finish(&rig, *state);
}

static void lights_of_scene_and_request_are_the_same(void **state)
{
    struct view_light lights[5];
    struct rig_scene rig;
    rig_asset_open(&rig, *state, "LightsPunctualLamp/glTF/LightsPunctualLamp.gltf");
    lights_of(&rig, lights, 5);
    struct view view = lamp_view();
    view.outputs = 1u << VIEW_OUTPUT_COLOR;
    view.width_px = 240;
    view.height_px = 135;
    struct image own = shoot_color(*state, &rig, &view);
    view.ignore_scene_lights = true;
    view.lights = lights;
    view.light_count = 5;
    struct image asked = shoot_color(*state, &rig, &view);
    assert_images_close(&own, &asked, 1e-3, 1e-5);
    image_finish(&own);
    image_finish(&asked);
    rig_scene_finish(&rig, *state);
}

/* -- ToyCar -- */

static void toy_car_is_seen_by_its_own_cameras(void **state)
{
    struct rig_scene rig;
    struct frame frame, bare;
    rig_asset_open(&rig, *state, "ToyCar/glTF/ToyCar.gltf");
    struct view view = asset_view((double[]){0, 0, 1}, (double[]){0, 0, 0}, 0);
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_NODE, .node = "Camera001"};
    asset_shoot(*state, &rig, &view, "ToyCar", &frame);
    const struct image *color = &frame.outputs[VIEW_OUTPUT_COLOR],
                       *nodes = &frame.outputs[VIEW_OUTPUT_NODE];
    uint32_t car = scene_node_id(&rig, "ToyCar"), glass = scene_node_id(&rig, "Glass");
    double fabric[3];
    size_t car_pixels = image_count_id(nodes, car), glass_pixels = image_count_id(nodes, glass);
    assert_true(car_pixels > 15000 && glass_pixels > 500);
    assert_true(image_mean_of(color, nodes, scene_node_id(&rig, "Fabric"), fabric) > 20000);
    assert_true(fabric[0] > 1.5 * fabric[1] && fabric[0] > 1.5 * fabric[2]);       /* red cloth */
    assert_true(share_of_hue(color, nodes, car, (double[]){-0.6, 1, -0.8}) > 0.1); /* green */
    /* The windows are of green glass (0.3 0.8 0.3), and the seats are behind them. */
    struct view_node_override hidden = {.node = "Glass", .has_visible = true};
    view.nodes = &hidden;
    view.node_override_count = 1;
    shoot(*state, &rig, &view, &bare);
    double through[3], open[3];
    image_mean_of(color, nodes, glass, through);
    image_mean_of(&bare.outputs[VIEW_OUTPUT_COLOR], nodes, glass, open);
    assert_true(image_count_id(&bare.outputs[VIEW_OUTPUT_NODE], car) > car_pixels);
    assert_true(through[1] / open[1] > 1.3 * through[0] / open[0]);
    frame_finish(&frame);
    frame_finish(&bare);
    view = asset_view((double[]){-0.03, 0.03, 0.06}, (double[]){0, 0, 0}, 50);
    asset_check_invariants(*state, &rig, &view);
    rig_scene_finish(&rig, *state);
}

/* -- SheenChair -- */

static void chair_has_fabric_on_wooden_legs(void **state)
{
    struct rig_scene rig;
    struct frame frame;
    double mean[3];
    rig_asset_open(&rig, *state, "SheenChair/glTF/SheenChair.gltf");
    struct view view = asset_view((double[]){0.6, 0.8, 1.5}, (double[]){0, 0.34, 0}, 32);
    asset_shoot(*state, &rig, &view, "SheenChair", &frame);
    const struct image *color = &frame.outputs[VIEW_OUTPUT_COLOR],
                       *nodes = &frame.outputs[VIEW_OUTPUT_NODE];
    uint32_t fabric = scene_node_id(&rig, "SheenChair_fabric");
    size_t count = image_mean_of(color, nodes, fabric, mean);
    assert_true(count > 15000);
    assert_true(mean[0] > 5 * mean[1] && mean[1] > mean[2]); /* mango */
    count = image_mean_of(color, nodes, scene_node_id(&rig, "SheenChair_wood"), mean);
    assert_true(count > 700 && mean[0] > mean[1] && mean[1] > mean[2]); /* brown */
    /* Seat up, back rest behind: normals of the fabric turn from +Y below to +Z above. */
    const float *seat =
        image_at(&frame.outputs[VIEW_OUTPUT_NORMAL], &view, (double[]){0.1, 0.4, 0.12});
    const float *rest =
        image_at(&frame.outputs[VIEW_OUTPUT_NORMAL], &view, (double[]){0.2, 0.56, -0.2});
    assert_true(seat[1] > 0.8f);
    assert_true(rest[2] > 0.6f);
    /* The weave of the normal map, repeated by KHR_texture_transform, roughens the fabric. */
    double roughness = 0;
    const float *normals = frame.outputs[VIEW_OUTPUT_NORMAL].pixels;
    for (size_t i = 0; i + 1 < 480 * 270; i++)
        if (((const uint32_t *)nodes->pixels)[i] == fabric &&
            ((const uint32_t *)nodes->pixels)[i + 1] == fabric)
            roughness += fabs((double)(normals[3 * i] - normals[3 * i + 3]));
    assert_true(roughness / 20000 > 0.01);
    frame_finish(&frame);
    asset_check_invariants(*state, &rig, &view);
    rig_scene_finish(&rig, *state);
}

/* -- Sponza -- */

static const struct view_light sponza_lights[4] = {
    {.type = SCENE_LIGHT_SPOT,
     .position = {-1, 9, -0.3},
     .direction = {0.3, -1, 0},
     .color = {1, 0.95, 0.85},
     .intensity = 1500,
     .inner_cone_deg = 15,
     .outer_cone_deg = 30},
    {.type = SCENE_LIGHT_POINT,
     .position = {-5, 1.5, -0.3},
     .color = {1, 0.7, 0.4},
     .intensity = 40},
    {.type = SCENE_LIGHT_DIRECTIONAL,
     .direction = {0.15, -1, 0.12},
     .color = {0.9, 0.95, 1},
     .intensity = 15},
    /* from the aisle, through the curtains */
    {.type = SCENE_LIGHT_SPOT,
     .position = {-2.5, 1.9, -4.3},
     .direction = {0, -0.35, 1},
     .color = {1, 1, 1},
     .intensity = 1000,
     .inner_cone_deg = 40,
     .outer_cone_deg = 60},
};

static const char *const curtains[] = {"fabric_a", "fabric_c", "fabric_d",
                                       "fabric_e", "fabric_f", "fabric_g"};
enum { CURTAINS = sizeof curtains / sizeof *curtains };

static void make_curtains(struct view_material_override glass[CURTAINS])
{
    for (int i = 0; i < CURTAINS; i++)
        glass[i] = (struct view_material_override){.material = curtains[i],
                                                   .has_transmission = true,
                                                   .transmission = 0.7f,
                                                   .has_ior = true,
                                                   .ior = 1,
                                                   .has_metallic = true,
                                                   .has_roughness = true,
                                                   .roughness = 1};
}

static struct view sponza_view(void)
{
    return asset_view((double[]){-8.5, 2.2, -0.3}, (double[]){4, 1.6, -0.3}, 60);
}

static void sponza_is_lit_by_four_lights(void **state)
{
    struct rig_scene rig;
    struct frame frame;
    struct view_material_override glass[CURTAINS];
    rig_asset_open(&rig, *state, "Sponza/glTF/Sponza.gltf");
    make_curtains(glass);
    struct view view = sponza_view();
    view.lights = sponza_lights;
    view.light_count = 4;
    view.materials = glass;
    view.material_override_count = CURTAINS;
    asset_shoot(*state, &rig, &view, "Sponza", &frame);
    assert_int_equal(frame.report.counts.lights, 4);
    assert_int_equal(frame.report.counts.shadowed_lights, 4);
    assert_int_equal(frame.report.warning_count, 0);
    assert_true(report_has_pass(&frame.report, "shadow.", "deep"));
    assert_true(frame.report.counts.events > 50000);
    const struct image *materials = &frame.outputs[VIEW_OUTPUT_MATERIAL];
    static const char *const seen[] = {"floor", "column_a", "bricks", "arch", "fabric_c"};
    for (int i = 0; i < 5; i++)
        assert_true(image_count_id(materials, scene_material_id(&rig, seen[i])) > 200);
    view.camera.eye[0] += 0.5; /* nothing is rebuilt for another camera */
    frame_finish(&frame);
    shoot(*state, &rig, &view, &frame);
    assert_int_equal(frame.report.counts.shadow_maps_built, 0);
    assert_int_equal(frame.report.counts.shadow_maps_reused, 4);
    frame_finish(&frame);
    asset_check_invariants(*state, &rig, &view);
    rig_scene_finish(&rig, *state);
}

/* Under the light of the aisle alone: what is behind curtains of glass, and of cloth. */
static void curtains_of_sponza_colour_the_floor(void **state)
{
    struct rig_scene rig;
    struct view_material_override glass[CURTAINS];
    rig_asset_open(&rig, *state, "Sponza/glTF/Sponza.gltf");
    make_curtains(glass);
    struct view view = sponza_view();
    view.lights = &sponza_lights[3];
    view.light_count = 1;
    view.materials = glass;
    view.material_override_count = CURTAINS;
    struct frame lit;
    shoot(*state, &rig, &view, &lit);
    save_picture(&lit.outputs[VIEW_OUTPUT_COLOR], "Sponza-curtains");
    uint32_t floor_id = scene_material_id(&rig, "floor");
    const struct image *materials = &lit.outputs[VIEW_OUTPUT_MATERIAL];
    static const double red[3] = {1, -0.5, -0.5}, green[3] = {-0.7, 1, -0.8},
                        blue[3] = {-0.6, 0, 1};
    const struct image *color = &lit.outputs[VIEW_OUTPUT_COLOR];
    double shares[3] = {share_of_hue(color, materials, floor_id, red),
                        share_of_hue(color, materials, floor_id, green),
                        share_of_hue(color, materials, floor_id, blue)};
    view.materials = NULL; /* curtains of cloth */
    view.material_override_count = 0;
    struct image cloth = shoot_color(*state, &rig, &view);
    double through[3], blocked[3];
    image_mean_of(color, materials, floor_id, through);
    image_mean_of(&cloth, materials, floor_id, blocked);
    /* The blue curtain with its golden ornament, seen on the floor before it. */
    if (!(shares[2] > 0.2 && shares[0] > 0.01 && shares[0] < 0.2))
        fail_msg("of the floor, %g is red, %g green and %g blue", shares[0], shares[1], shares[2]);
    assert_true(luminance(blocked) < luminance(through));
    image_finish(&cloth);
    frame_finish(&lit);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lamp_is_lit_by_its_own_coloured_lights),
        cmocka_unit_test(lights_of_scene_and_request_are_the_same),
        cmocka_unit_test(toy_car_is_seen_by_its_own_cameras),
        cmocka_unit_test(chair_has_fabric_on_wooden_legs),
        cmocka_unit_test(sponza_is_lit_by_four_lights),
        cmocka_unit_test(curtains_of_sponza_colour_the_floor),
    };
    if (!assets_are_present())
        return 77;
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Scenes of others that show transmission: measured by what the picture keeps of the things behind,
 * with and without the glass. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/asset_checks.h"

static const double pi = 3.14159265358979323846;

/* Lit from beside and without shadows or a sky: behind glass only the backdrop has light. */
static const struct view_light side_light = {.type = SCENE_LIGHT_DIRECTIONAL,
                                             .direction = {0.7, -0.3, -0.6},
                                             .color = {1, 1, 1},
                                             .intensity = 5};

static void light_backdrop(struct view *view, const struct view_light *light)
{
    view->lights = light;
    view->light_count = 1;
    view->outputs = 1u << VIEW_OUTPUT_COLOR;
    view->quality.shadows = SHADOWS_NONE;
    view->quality.refraction = VIEW_REFRACTION_OFF; /* the filters are asked for, ray by ray */
}

/* What share of the second picture's light the first one shows at a world point. */
static void share_at(const struct image *with, const struct image *without, const struct view *view,
                     const double at[3], double share[3])
{
    for (int c = 0; c < 3; c++)
        share[c] = (double)image_at(with, view, at)[c] / image_at(without, view, at)[c];
}

static void assert_share(const double share[3], const double expected[3], double tolerance,
                         const char *what)
{
    for (int c = 0; c < 3; c++)
        if (!(fabs(share[c] - expected[c]) <= tolerance))
            fail_msg("%s keeps (%.4f %.4f %.4f), expected (%.4f %.4f %.4f)", what, share[0],
                     share[1], share[2], expected[0], expected[1], expected[2]);
}

/* -- AttenuationTest: rows of blocks, columns of thickness 0.25 to 2 -- */

enum { ROWS = 5, TEXTURED = 4 };

static const struct column {
    double x, thickness_m;
    const char *nodes[ROWS]; /* thickness by a sample's colour, its factor, the node's scale; by the
                                attenuation's distance; by a texture on one mesh */
} columns[] = {
    {-3.5,
     0.25,
     {"R1_Sample_0.25", "R2_Block_0.25", "R4_Block_0.25", "R5_Block_0.25", "R3_Block_Row"}},
    {-2,
     0.5,
     {"R1_Sample_0.50", "R2_Block_0.50", "R4_Block_0.50", "R5_Block_0.50", "R3_Block_Row"}},
    {0, 1, {"R1_Sample_1.0", "R2_Block_1.0", "R4_Block_1.0", "R5_Block_1.0", "R3_Block_Row"}},
    {2.5, 1.5, {"R1_Sample_1.5", "R2_Block_1.5", "R4_Block_1.5", "R5_Block_1.5", "R3_Block_Row"}},
    {6, 2, {"R1_Sample_2.0", "R2_Block_2.0", "R4_Block_2.0", "R5_Block_2.0", "R3_Block_Row"}},
};
enum { COLUMNS = sizeof columns / sizeof *columns, HIDDEN = TEXTURED * COLUMNS + 1 };
static const double row_y[ROWS] = {6, 3, -3, -6, 0};

static void hide_blocks(struct view_node_override hidden[HIDDEN])
{
    for (int i = 0; i < HIDDEN; i++)
        hidden[i] = (struct view_node_override){
            .node = i < HIDDEN - 1 ? columns[i / TEXTURED].nodes[i % TEXTURED] : "R3_Block_Row",
            .has_visible = true};
}

/* Beer and Lambert: attenuationColor ^ (thickness / attenuationDistance). */
static void beer(double thickness_m, double factor, double t[3])
{
    static const double color[3] = {0.1, 0.5, 0.9};
    for (int c = 0; c < 3; c++)
        t[c] = factor * pow(color[c], thickness_m);
}

static void blocks_attenuate_the_view_by_beers_law(void **state)
{
    struct rig_scene rig;
    struct frame frame;
    struct view_node_override hidden[HIDDEN];
    rig_asset_open(&rig, *state, "AttenuationTest/glTF-Binary/AttenuationTest.glb");
    struct view view = asset_view((double[]){0, 0, 80}, (double[]){0, 0, 0}, 15);
    asset_shoot(*state, &rig, &view, "AttenuationTest", &frame);
    assert_int_equal(image_id_at(&frame.outputs[VIEW_OUTPUT_MATERIAL], &view, (double[]){6, -3, 0}),
                     scene_material_id(&rig, "R2_and_R4_ThicknessFac_1.0")); /* shared at several
                                                                                scales */
    frame_finish(&frame);
    asset_check_invariants(*state, &rig, &view);
    light_backdrop(&view, &side_light);
    struct image with = shoot_color(*state, &rig, &view);
    hide_blocks(hidden);
    view.nodes = hidden;
    view.node_override_count = HIDDEN;
    struct image without = shoot_color(*state, &rig, &view);
    for (int i = 0; i < COLUMNS; i++)
        for (int row = 0; row < ROWS; row++) {
            double share[3], expected[3];
            const double at[3] = {columns[i].x, row_y[row], 0};
            share_at(&with, &without, &view, at, share);
            beer(columns[i].thickness_m, 0.96, expected); /* less 4 % at the face, ior 1.5 */
            assert_share(share, expected, row == TEXTURED ? 0.02 : 0.01, columns[i].nodes[row]);
        }
    image_finish(&with);
    image_finish(&without);
    rig_scene_finish(&rig, *state);
}

static void blocks_cast_shadows_by_beers_law(void **state)
{
    const struct view_light front = {.type = SCENE_LIGHT_DIRECTIONAL,
                                     .direction = {0, 0, -1},
                                     .color = {1, 1, 1},
                                     .intensity = 3};
    struct view_node_override hidden[HIDDEN];
    struct rig_scene rig;
    rig_asset_open(&rig, *state, "AttenuationTest/glTF-Binary/AttenuationTest.glb");
    /* From between the blocks and the backdrop. */
    struct view view = asset_view((double[]){1.25, 0, -0.4}, (double[]){1.25, 0, -2},
                                  2 * atan(7 / 1.6) * 180 / pi);
    light_backdrop(&view, &front);
    view.quality.samples = 1;
    hide_blocks(hidden);
    view.nodes = hidden;
    for (int technique = 0; technique < 2; technique++) {
        view.quality.shadows = technique ? SHADOWS_RAYTRACED : SHADOWS_DEEP;
        view.node_override_count = 0;
        struct image lit = shoot_color(*state, &rig, &view);
        save_picture(&lit, technique ? "AttenuationTest-raytraced" : "AttenuationTest-shadows");
        view.node_override_count = HIDDEN;
        struct image open = shoot_color(*state, &rig, &view);
        for (int i = 0; i < COLUMNS * ROWS; i++) {
            const struct column *column = &columns[i / ROWS];
            double share[3], expected[3];
            const double at[3] = {column->x, row_y[i % ROWS], -2};
            share_at(&lit, &open, &view, at, share);
            beer(column->thickness_m, 1, expected);
            assert_share(share, expected, i % ROWS == TEXTURED ? 0.02 : 0.005,
                         column->nodes[i % ROWS]);
        }
        image_finish(&lit);
        image_finish(&open);
    }
    rig_scene_finish(&rig, *state);
}

/* -- TransmissionTest: spheres before a chequered cloth -- */

static struct view spheres_view(void)
{
    return asset_view((double[]){0, 0.1, 1.6}, (double[]){-0.01, 0.05, 0}, 32);
}

static void clear_sphere_keeps_its_colour_squared(void **state)
{
    struct rig_scene rig;
    struct frame frame;
    rig_asset_open(&rig, *state, "TransmissionTest/glTF-Binary/TransmissionTest.glb");
    struct view view = spheres_view();
    asset_shoot(*state, &rig, &view, "TransmissionTest", &frame);
    frame_finish(&frame);
    asset_check_invariants(*state, &rig, &view);
    light_backdrop(&view, &side_light);
    struct view_node_override hidden = {.node = "YellowTrans", .has_visible = true};
    struct image with = shoot_color(*state, &rig, &view);
    view.nodes = &hidden;
    view.node_override_count = 1;
    struct image without = shoot_color(*state, &rig, &view);
    static const double base[3] = {0.84687, 0.87137, 0.09306}; /* of the file, linear */
    double share[3], expected[3];
    share_at(&with, &without, &view, (double[]){-0.367, 0.226, -0.01}, share);
    for (int c = 0; c < 3; c++) /* two faces, 4 % reflected at each */
        expected[c] = base[c] * base[c] * 0.96 * 0.96;
    assert_share(share, expected, 0.02, "YellowTrans");
    image_finish(&with);
    image_finish(&without);
    rig_scene_finish(&rig, *state);
}

/* Pixels of the node that show the cloth behind, and those that do not. */
static void count_seen_through(const struct image *with, const struct image *without,
                               const struct image *nodes, uint32_t id, int *through, int *opaque)
{
    *through = *opaque = 0;
    for (size_t i = 0; i < 480 * 270; i++) {
        const float *p = (const float *)with->pixels + 4 * i,
                    *q = (const float *)without->pixels + 4 * i;
        double apart = 0;
        if (((const uint32_t *)nodes->pixels)[i] != id)
            continue;
        for (int c = 0; c < 3; c++)
            apart = fmax(apart, fabs((double)(p[c] - q[c])));
        *through += apart > 0.01;
        *opaque += apart < 1e-6;
    }
}

static void transmission_textures_and_masks_tell_glass_from_paint(void **state)
{
    static const struct {
        const char *node;
        bool has_paint; /* a texture makes part of the sphere opaque */
    } spheres[] = {{"YellowTrans", false},        {"RedTransTexture", true},
                   {"YellowTransRough", false},   {"RedTransTextureRough", true},
                   {"GreenMask", false},          {"YellowTransMetal", true},
                   {"RedTransTextureMetal", true}};
    struct rig_scene rig;
    struct frame frame;
    rig_asset_open(&rig, *state, "TransmissionTest/glTF-Binary/TransmissionTest.glb");
    struct view view = spheres_view();
    view.quality.samples = 1;
    view.lights = &side_light;
    view.light_count = 1;
    view.quality.shadows = SHADOWS_NONE;
    view.quality.refraction = VIEW_REFRACTION_OFF;
    shoot(*state, &rig, &view, &frame);
    struct view_node_override hidden = {.node = "Cloth Backdrop 01", .has_visible = true};
    view.nodes = &hidden;
    view.node_override_count = 1;
    view.outputs = 1u << VIEW_OUTPUT_COLOR;
    view.background[0] = view.background[1] = view.background[2] = 3; /* unlike any cloth */
    struct image without = shoot_color(*state, &rig, &view);
    for (size_t i = 0; i < sizeof spheres / sizeof *spheres; i++) {
        int through, opaque;
        count_seen_through(&frame.outputs[VIEW_OUTPUT_COLOR], &without,
                           &frame.outputs[VIEW_OUTPUT_NODE], scene_node_id(&rig, spheres[i].node),
                           &through, &opaque);
        if (through < 100 || (opaque > 100) != spheres[i].has_paint)
            fail_msg("%s: %d pixels show what is behind, %d do not", spheres[i].node, through,
                     opaque);
    }
    image_finish(&without);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

/* -- GlassVaseFlowers: one vase by BLEND, one by transmission -- */

static void flowers_are_seen_through_both_vases(void **state)
{
    static const char *const vases[2] = {"GlassAlpha", "GlassTransmission"};
    struct rig_scene rig;
    struct frame frame;
    rig_asset_open(&rig, *state, "GlassVaseFlowers/glTF-Binary/GlassVaseFlowers.glb");
    struct view view = asset_view((double[]){0.16, 0.16, 0.42}, (double[]){0.055, 0.1, 0}, 32);
    asset_shoot(*state, &rig, &view, "GlassVaseFlowers", &frame);
    asset_check_invariants(*state, &rig, &view);
    struct view_node_override hidden[2];
    for (int v = 0; v < 2; v++)
        hidden[v] = (struct view_node_override){.node = vases[v], .has_visible = true};
    struct frame bare;
    view.nodes = hidden;
    view.node_override_count = 2;
    shoot(*state, &rig, &view, &bare);
    int petals = 0, leaves = 0, behind[2] = {0};
    double kept[2] = {0};
    for (size_t i = 0; i < 480 * 270; i++) {
        const float *p = (const float *)frame.outputs[VIEW_OUTPUT_COLOR].pixels + 4 * i;
        const float *q = (const float *)bare.outputs[VIEW_OUTPUT_COLOR].pixels + 4 * i;
        uint32_t node = ((const uint32_t *)frame.outputs[VIEW_OUTPUT_NODE].pixels)[i];
        uint32_t flower = ((const uint32_t *)bare.outputs[VIEW_OUTPUT_NODE].pixels)[i];
        petals += p[0] > 1.3f * p[1] && p[2] > 1.1f * p[1];
        leaves += p[1] > 1.3f * p[0] && p[1] > 2 * p[2];
        for (int v = 0; v < 2; v++)
            if (node == scene_node_id(&rig, vases[v]) && flower && q[1] > 0.02f) {
                behind[v]++;
                kept[v] += (double)(p[1] / q[1]);
            }
    }
    assert_true(petals > 300 && leaves > 300);
    for (int v = 0; v < 2; v++) { /* stems and leaves, through clear or grey glass */
        assert_true(behind[v] > 200);
        double mean = kept[v] / behind[v];
        if (!(mean > (v ? 0.6 : 0.3) && mean < 1.2))
            fail_msg("%s: stems keep %g of their light", vases[v], mean);
    }
    frame_finish(&frame);
    frame_finish(&bare);
    rig_scene_finish(&rig, *state);
}

/* -- StainedGlassLamp: glowing bulbs inside a shade of painted glass -- */

static void bulbs_glow_through_the_stained_glass(void **state)
{
    struct rig_scene rig;
    struct frame frame, dark;
    rig_asset_open(&rig, *state,
                   "StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp-transmission.gltf");
    struct view view = asset_view((double[]){0.25, 0.5, 0.9}, (double[]){0, 0.36, 0}, 42);
    asset_shoot(*state, &rig, &view, "StainedGlassLamp", &frame);
    asset_check_invariants(*state, &rig, &view);
    uint32_t shade = scene_node_id(&rig, "stainedglass");
    int hues[3] = {0}, pixels = 0;
    for (size_t i = 0; i < 480 * 270; i++) {
        if (((const uint32_t *)frame.outputs[VIEW_OUTPUT_NODE].pixels)[i] != shade)
            continue;
        const float *p = (const float *)frame.outputs[VIEW_OUTPUT_COLOR].pixels + 4 * i;
        pixels++;
        for (int c = 0; c < 3; c++)
            hues[c] += p[c] > 1.5f * p[(c + 1) % 3] && p[c] > 1.5f * p[(c + 2) % 3];
    }
    assert_true(pixels > 3000);
    for (int c = 0; c < 3; c++)
        if (hues[c] < pixels / 200)
            fail_msg("%d of %d pixels have hue %d", hues[c], pixels, c);
    struct view_material_override off = {.material = "bulbs", .has_emissive = true};
    view.materials = &off;
    view.material_override_count = 1;
    shoot(*state, &rig, &view, &dark);
    int through, opaque;
    count_seen_through(&frame.outputs[VIEW_OUTPUT_COLOR], &dark.outputs[VIEW_OUTPUT_COLOR],
                       &frame.outputs[VIEW_OUTPUT_NODE], shade, &through, &opaque);
    if (through < 30 || opaque < 1000)
        fail_msg("bulbs change %d pixels of the shade, not %d", through, opaque);
    frame_finish(&frame);
    frame_finish(&dark);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_attenuate_the_view_by_beers_law),
        cmocka_unit_test(blocks_cast_shadows_by_beers_law),
        cmocka_unit_test(clear_sphere_keeps_its_colour_squared),
        cmocka_unit_test(transmission_textures_and_masks_tell_glass_from_paint),
        cmocka_unit_test(flowers_are_seen_through_both_vases),
        cmocka_unit_test(bulbs_glow_through_the_stained_glass),
    };
    if (!assets_are_present())
        return 77;
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

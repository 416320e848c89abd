/* SPDX-License-Identifier: MIT */
/* Scenes of others that show whether axes, winding and alpha modes are right. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/asset_checks.h"

/* -- OrientationTest: a cube with an arrow on each face that points at a target of its colour -- */

static const struct arrow {
    const char *node, *target;
    double face[3], tip[3]; /* outward normal; a point on the arrow's upper side, towards its tip */
    double color[3];        /* which channels the arrow reflects */
} arrows[] = {
    {"ArrowX1", "TargetX1", {1, 0, 0}, {5.33, 1.64, -1.147}, {1, 0, 0}},
    {"ArrowY1", "TargetY1", {0, 1, 0}, {1.879, 5.33, -0.684}, {0, 1, 0}},
    {"ArrowZ1", "TargetZ1", {0, 0, 1}, {-0.518, 1.932, 5.33}, {0, 0, 1}},
    {"ArrowX2", "TargetX2", {-1, 0, 0}, {0}, {0, 1, 1}},
    {"ArrowY2", "TargetY2", {0, -1, 0}, {0}, {1, 0, 1}},
    {"ArrowZ2", "TargetZ2", {0, 0, -1}, {0}, {1, 1, 0}},
};

static struct view face_view(const struct arrow *arrow)
{
    static const double middle[3] = {0, 0, 0};
    double eye[3];
    for (int i = 0; i < 3; i++)
        eye[i] = 40 * arrow->face[i];
    struct view view = asset_view(eye, middle, 18);
    if (arrow->face[1] != 0)
        view.camera.up[2] = -1;
    return view;
}

static void assert_hue(const double mean[3], const double color[3], const char *what)
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            if (color[i] > 0 && color[k] <= 0 && !(mean[i] > 2 * mean[k]))
                fail_msg("%s is (%g, %g, %g)", what, mean[0], mean[1], mean[2]);
}

static void orientation_arrows_point_along_their_axes(void **state)
{
    struct rig_scene rig;
    rig_asset_open(&rig, *state, "OrientationTest/glTF-Binary/OrientationTest.glb");
    for (size_t a = 0; a < sizeof arrows / sizeof *arrows; a++) {
        const struct arrow *arrow = &arrows[a];
        struct view view = face_view(arrow);
        struct frame frame;
        double mean[3];
        char picture[64];
        snprintf(picture, sizeof picture, "OrientationTest-%s", arrow->node);
        asset_shoot(*state, &rig, &view, picture, &frame);
        const struct image *nodes = &frame.outputs[VIEW_OUTPUT_NODE];
        size_t count = image_mean_of(&frame.outputs[VIEW_OUTPUT_COLOR], nodes,
                                     scene_node_id(&rig, arrow->node), mean);
        assert_true(count > 200);
        assert_hue(mean, arrow->color, arrow->node);
        assert_true(image_count_id(nodes, scene_node_id(&rig, arrow->target)) > 20);
        /* The arrow of the far side is hidden: pairs lie three apart in the table. */
        const char *hidden = arrows[(a + 3) % 6].node;
        assert_int_equal(image_count_id(nodes, scene_node_id(&rig, hidden)), 0);
        if (arrow->tip[0] != 0) { /* the rotation of the node turns it to its target */
            double turned[3] = {arrow->tip[0], arrow->tip[1], arrow->tip[2]};
            assert_int_equal(image_id_at(nodes, &view, turned), scene_node_id(&rig, arrow->node));
            for (int i = 0; i < 3; i++)
                if (arrow->face[i] <= 0)
                    turned[i] = -turned[i]; /* the other way is the cube's bare face */
            assert_int_equal(image_id_at(nodes, &view, turned), scene_node_id(&rig, "BaseCube"));
        }
        frame_finish(&frame);
    }
    struct view view = asset_view_from(&rig, (double[]){0.5, 0.5, 1}, 32);
    struct frame frame;
    asset_shoot(*state, &rig, &view, "OrientationTest", &frame);
    frame_finish(&frame);
    asset_check_invariants(*state, &rig, &view);
    rig_scene_finish(&rig, *state);
}

/* -- AlphaBlendModeTest: one textured card per mode, its alpha falling from bottom to top -- */

static struct view cards_view(void)
{
    return asset_view((double[]){0, 1.1, 9}, (double[]){0, 1.05, 0}, 28);
}

/* Share of the card's height, from its foot, where its node is the nearest surface. */
static double visible_share(const struct image *nodes, const struct view *view, double x,
                            uint32_t node)
{
    int seen = 0;
    for (int i = 0; i < 100; i++)
        seen += image_id_at(nodes, view, (double[]){x, 0.1 + 1.87 * (i + 0.5) / 100, 0}) == node;
    return seen / 100.0;
}

static void masked_cards_are_cut_at_their_cutoff(void **state)
{
    static const struct {
        const char *node;
        double x, share;
    } cards[] = {{"TestOpaque", -3, 1},
                 {"TestCutoff25", 0, 0.75},
                 {"TestCutoffDefault", 1.5, 0.5},
                 {"TestCutoff75", 3, 0.25}};
    struct rig_scene rig;
    struct frame frame;
    rig_asset_open(&rig, *state, "AlphaBlendModeTest/glTF-Binary/AlphaBlendModeTest.glb");
    struct view view = cards_view();
    asset_shoot(*state, &rig, &view, "AlphaBlendModeTest", &frame);
    for (size_t i = 0; i < sizeof cards / sizeof *cards; i++) {
        double share = visible_share(&frame.outputs[VIEW_OUTPUT_NODE], &view, cards[i].x,
                                     scene_node_id(&rig, cards[i].node));
        if (fabs(share - cards[i].share) > 0.08)
            fail_msg("%s covers %g of its height, expected %g", cards[i].node, share,
                     cards[i].share);
    }
    frame_finish(&frame);
    asset_check_invariants(*state, &rig, &view);
    rig_scene_finish(&rig, *state);
}

/* What the picture keeps of the marble behind the blended card, at a height: a line from 0 to 1. */
static void blended_card_fades_from_foot_to_top(void **state)
{
    struct rig_scene rig;
    rig_asset_open(&rig, *state, "AlphaBlendModeTest/glTF-Binary/AlphaBlendModeTest.glb");
    struct view view = cards_view();
    struct view_node_override hidden = {.node = "TestBlend", .has_visible = true};
    view.quality.shadows = SHADOWS_NONE;
    view.outputs = 1u << VIEW_OUTPUT_COLOR;
    struct image with = shoot_color(*state, &rig, &view);
    view.node_override_count = 1;
    view.nodes = &hidden;
    struct image without = shoot_color(*state, &rig, &view);
    double first = 0, last = INFINITY;
    for (int i = 0; i < 6; i++) { /* the striped part of the card */
        double apart = 0, y = 0.33 + 0.234 * (i + 0.5);
        for (int k = -4; k <= 4; k++) { /* over several stripes */
            const double at[3] = {-1.5 + 0.05 * k, y, 0};
            for (int c = 0; c < 3; c++)
                apart +=
                    fabs((double)image_at(&with, &view, at)[c] - image_at(&without, &view, at)[c]);
        }
        assert_true(apart < last);
        first = fmax(first, apart);
        last = apart;
    }
    assert_true(last < 0.25 * first);
    image_finish(&with);
    image_finish(&without);
    rig_scene_finish(&rig, *state);
}

/* -- NegativeScaleTest: what is mirrored looks as if it were not -- */

static void mirrored_nodes_show_their_front(void **state)
{
    static const char *const pairs[3][2] = {
        {"NotShiny1", "NotShinyMinus1"}, {"Dark1", "DarkMinus1"}, {"Shiny1", "ShinyMinus1"}};
    struct rig_scene rig;
    struct frame frame;
    rig_asset_open(&rig, *state, "NegativeScaleTest/glTF-Binary/NegativeScaleTest.glb");
    struct view view = asset_view((double[]){0, 0, 30}, (double[]){0, 0, 0}, 18);
    asset_shoot(*state, &rig, &view, "NegativeScaleTest", &frame);
    const struct image *color = &frame.outputs[VIEW_OUTPUT_COLOR],
                       *nodes = &frame.outputs[VIEW_OUTPUT_NODE];
    for (int i = 0; i < 3; i++) {
        double plus[3], minus[3];
        size_t n = image_mean_of(color, nodes, scene_node_id(&rig, pairs[i][0]), plus);
        size_t m = image_mean_of(color, nodes, scene_node_id(&rig, pairs[i][1]), minus);
        assert_true(n > 300 && fabs((double)n - (double)m) < 0.05 * (double)n);
        for (int c = 0; c < 3; c++)
            if (fabs(plus[c] - minus[c]) > 0.05 * plus[c])
                fail_msg("%s: channel %d is %g, mirrored %g", pairs[i][0], c, plus[c], minus[c]);
    }
    /* The cards are single-sided with a green tick on their front and a red cross on their back. */
    static const char *const cards[] = {"PositiveScaleTest", "NegativeScaleFront",
                                        "NegativeScaleBack"};
    for (int i = 0; i < 3; i++) {
        uint32_t id = scene_node_id(&rig, cards[i]);
        int green = 0, red = 0;
        for (int p = 0; p < 480 * 270; p++) {
            const float *q = (const float *)color->pixels + (size_t)p * 4;
            if (((const uint32_t *)nodes->pixels)[p] != id)
                continue;
            green += q[1] > 2 * q[0] && q[1] > 2 * q[2];
            red += q[0] > 2 * q[1] && q[0] > 2 * q[2];
        }
        assert_true(green > 20);
        assert_int_equal(red, 0);
    }
    frame_finish(&frame);
    asset_check_invariants(*state, &rig, &view);
    rig_scene_finish(&rig, *state);
}

/* A wrong sign would turn the normals of mirrored spheres inwards. Over a sphere's disc the mean of
 * the cosine to a far viewer is 2/3. */
static void mirrored_spheres_have_outward_normals(void **state)
{
    static const char *const spheres[] = {"NotShiny1",  "NotShinyMinus1", "Dark1",
                                          "DarkMinus1", "Shiny1",         "ShinyMinus1"};
    struct rig_scene rig;
    struct frame frame;
    rig_asset_open(&rig, *state, "NegativeScaleTest/glTF-Binary/NegativeScaleTest.glb");
    struct view view = asset_view((double[]){0, 0, 30}, (double[]){0, 0, 0}, 18);
    shoot(*state, &rig, &view, &frame);
    const float *normals = frame.outputs[VIEW_OUTPUT_NORMAL].pixels;
    const uint32_t *nodes = frame.outputs[VIEW_OUTPUT_NODE].pixels;
    for (int k = 0; k < 6; k++) {
        double sum = 0;
        int count = 0;
        for (size_t i = 0; i < 480 * 270; i++) {
            if (nodes[i] != scene_node_id(&rig, spheres[k]))
                continue;
            const float *n = normals + 3 * i;
            assert_true(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-3f);
            sum += (double)n[2];
            count++;
        }
        if (!(fabs(sum / count - 2.0 / 3) < 0.03))
            fail_msg("%s: mean cosine %g", spheres[k], sum / count);
    }
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(orientation_arrows_point_along_their_axes),
        cmocka_unit_test(masked_cards_are_cut_at_their_cutoff),
        cmocka_unit_test(blended_card_fades_from_foot_to_top),
        cmocka_unit_test(mirrored_nodes_show_their_front),
        cmocka_unit_test(mirrored_spheres_have_outward_normals),
    };
    if (!assets_are_present())
        return 77;
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

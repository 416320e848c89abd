/* SPDX-License-Identifier: MIT */
/* The ground plane under a block and a stained pane: what lies behind is multiplied by the share of
 * light that arrives, in every technique, and nothing else of a picture changes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/frame/renderer_internal.h"
#include "tests/support/boxes.h"
#include "tests/support/image_checks.h"

enum { SIZE = 96, MANY = 240 };

static const float behind[4] = {0.8f, 0.6f, 0.4f, 1};
static const double stain[3] = {0.9, 0.4, 0.1}; /* of one crossing; light crosses two */
static const double lit_place[2] = {0, 1.5}, block_shadow[2] = {-0.6, 0},
                    pane_shadow[2] = {1.55, 0};

static void open_block_and_pane(struct rig_scene *rig, struct renderer *renderer)
{
    static const struct glb_material_desc block = {
        .name = "Block", .base_color = {1, 1, 1, 1}, .roughness = 1};
    const struct glb_material_desc pane = {.name = "Pane",
                                           .base_color = {stain[0], stain[1], stain[2], 1},
                                           .roughness = 1,
                                           .transmission = 1,
                                           .has_ior = true,
                                           .ior = 1};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Ground", &err);
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    builder_add_box(builder, &block, (const double[]){-1.2, 1, -0.3},
                    (const double[]){-0.8, 1.2, 0.3});
    builder_add_box(builder, &pane, (const double[]){0.6, 1, -0.3},
                    (const double[]){1.4, 1.2, 0.3});
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "ground", glb, size_bytes);
    free(glb);
}

/* A slanting sun, and a lamp at a known distance that casts no shadow. */
static const struct view_light lights[2] = {
    {.type = SCENE_LIGHT_DIRECTIONAL,
     .direction = {0.3, -1, 0},
     .color = {1, 1, 1},
     .intensity = 3},
    {.type = SCENE_LIGHT_POINT,
     .position = {0, 5, 0},
     .color = {1, 0.5f, 0.25f},
     .intensity = 20,
     .casts_no_shadow = true},
};

/* From above. */
static struct view look(enum shadow_technique shadows, size_t light_count)
{
    struct view view = {
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {0, 8, 0},
                   .up = {0, 0, -1},
                   .ortho_height = 4},
        .lights = lights,
        .light_count = light_count,
        .ground_plane = {.is_shown = true, .has_height = true, .height_m = 0},
        .quality = {.samples = 1, .shadows = shadows},
    };
    memcpy(view.background, behind, sizeof behind);
    return view;
}

static const float *at(const struct image *image, const double place[2])
{
    int column = (int)((place[0] / 4 + 0.5) * SIZE), row = (int)((place[1] / 4 + 0.5) * SIZE);
    return image_pixel_f32(image, column, row);
}

/* The share of the light that arrives at a place, where the sun passes what `sun` says. */
static double share(const double place[2], double sun, int channel)
{
    double square = place[0] * place[0] + place[1] * place[1] + 25;
    double from_lamp = 20 * (double)lights[1].color[channel] * 5 / (square * sqrt(square));
    double from_sun = 3 / sqrt(1.09);
    return (sun * from_sun + from_lamp) / (from_sun + from_lamp);
}

static const struct {
    enum shadow_technique shadows;
    bool reference;
} ways[] = {
    {SHADOWS_MAP, false},         {SHADOWS_DEEP, false},
    {SHADOWS_DEEP_LINKED, false}, {SHADOWS_RAYTRACED_SHADOWS, false},
    {SHADOWS_RAYTRACED, false},   {SHADOWS_RAYTRACED, true},
    {SHADOWS_NONE, false},
};

/* What light loses to the block and to the pane by this technique. */
static double passed(enum shadow_technique shadows, bool is_pane, int channel)
{
    bool is_filtered = shadow_technique_can(shadows, SHADOW_CAN_COLOR);
    if (shadows == SHADOWS_NONE)
        return 1;
    return !is_pane ? 0 : is_filtered ? stain[channel] * stain[channel] : 1;
}

static void check(const struct image *image, const double place[2], enum shadow_technique shadows,
                  size_t light_count, const char *what)
{
    for (int k = 0; k < 3; k++) {
        double sun = place == lit_place ? 1 : passed(shadows, place == pane_shadow, k);
        double expected = (double)behind[k] * (light_count > 1 ? share(place, sun, k) : sun);
        double found = (double)at(image, place)[k];
        if (fabs(found - expected) > 2e-4 * (double)behind[k])
            fail_msg("%s, %zu lights, channel %d %s: %.6f instead of %.6f",
                     shadow_technique_name((int)shadows), light_count, k, what, found, expected);
    }
    assert_true(at(image, place)[3] == 1);
}

static void the_background_is_darkened_by_the_share_of_light(void **state)
{
    struct rig_scene rig;
    open_block_and_pane(&rig, *state);
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++)
        for (size_t count = 1; count <= 2; count++) {
            struct view view = look(ways[i].shadows, count);
            view.quality.reference = ways[i].reference;
            struct image image = shoot_color(*state, &rig, &view);
            check(&image, lit_place, ways[i].shadows, count, "in the light");
            check(&image, block_shadow, ways[i].shadows, count, "behind the block");
            check(&image, pane_shadow, ways[i].shadows, count, "behind the pane");
            if (count == 2 && ways[i].shadows == SHADOWS_DEEP)
                save_picture(&image, "ground_plane_deep");
            image_finish(&image);
        }
    rig_scene_finish(&rig, *state);
}

/* Under a lamp whose parts are dealt with one after the other. */
static void many_lights_in_parts_are_one(void **state)
{
    struct view_light many[MANY];
    struct rig_scene rig;
    open_block_and_pane(&rig, *state);
    for (int i = 0; i < MANY; i++) {
        many[i] = lights[0];
        many[i].intensity /= MANY;
        many[i].direction[0] += 1e-6 * i; /* maps of equal lights would be one */
    }
    struct renderer *renderer = *state;
    const uint64_t most_bytes = renderer->shadow_most_bytes;
    const uint64_t loop_steps = renderer->frames.shade.loop_steps;
    static const enum shadow_technique techniques[] = {SHADOWS_MAP, SHADOWS_MAP,
                                                       SHADOWS_RAYTRACED_SHADOWS};
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        bool is_in_batches = i == 1;
        struct view view = look(techniques[i], 1);
        renderer->shadow_most_bytes = is_in_batches ? 1 << 20 : most_bytes;
        renderer->frames.shade.loop_steps = 5000;
        renderer_drop_structures(renderer, rig.key);
        view.lights = many;
        view.light_count = MANY;
        view.quality.shadow_taps = 16;
        view.quality.shadow_resolution = 128;
        struct frame frame;
        shoot(*state, &rig, &view, &frame);
        const struct image *image = &frame.outputs[VIEW_OUTPUT_COLOR];
        if (is_in_batches)
            assert_int_in_range(frame.report.counts.light_batches, 2, 100);
        else if (techniques[i] == SHADOWS_MAP)
            assert_int_in_range(frame.report.counts.light_chunks, 2, 100);
        check(image, lit_place, techniques[i], 1, "in the light");
        check(image, block_shadow, techniques[i], 1, "behind the block");
        check(image, pane_shadow, techniques[i], 1, "behind the pane");
        frame_finish(&frame);
    }
    renderer->shadow_most_bytes = most_bytes;
    renderer->frames.shade.loop_steps = loop_steps;
    rig_scene_finish(&rig, *state);
}

/* What hides a part of the studio from the ground, found by rays. */
static void light_of_a_map_has_its_shadow_by_rays(void **state)
{
    static const double beside[2] = {-0.6, 0.3};
    struct rig_scene rig;
    open_block_and_pane(&rig, *state);
    struct view view = look(SHADOWS_MAP, 0);
    view.environment_key = VIEW_STUDIO_KEY;
    view.environment_intensity = 1;
    struct image whole = shoot_color(*state, &rig, &view);
    view.quality.environment_visibility = VIEW_VISIBILITY_RAYS;
    view.quality.environment_samples = 1024;
    struct image seen = shoot_color(*state, &rig, &view);
    view.quality.shadows = SHADOWS_RAYTRACED;
    view.quality.reference = true;
    view.quality.environment_samples = 256;
    struct image reference = shoot_color(*state, &rig, &view);
    double expected = (double)at(&reference, beside)[0] / (double)behind[0];
    double found = (double)at(&seen, beside)[0] / (double)behind[0];
    print_message("%.4f of the map arrives, by the reference %.4f\n", found, expected);
    assert_true(expected < 0.98 && fabs(found - expected) < 0.25 * (1 - expected));
    assert_true(at(&whole, beside)[0] == behind[0]);
    image_finish(&whole);
    image_finish(&seen);
    image_finish(&reference);
    rig_scene_finish(&rig, *state);
}

/* Where the picture is transparent, it is as dark as the light that is missing. */
static void a_transparent_picture_has_its_shadow_as_alpha(void **state)
{
    struct rig_scene rig;
    open_block_and_pane(&rig, *state);
    for (size_t i = 0; i < sizeof ways / sizeof *ways - 1; i++) {
        struct view view = look(ways[i].shadows, 1);
        view.quality.reference = ways[i].reference;
        memset(view.background, 0, sizeof view.background);
        struct image image = shoot_color(*state, &rig, &view);
        assert_true(at(&image, lit_place)[3] == 0);
        assert_true(at(&image, block_shadow)[3] > 0.9999f);
        for (int k = 0; k < 3; k++)
            assert_true(at(&image, block_shadow)[k] == 0);
        double tint = 0;
        for (int k = 0; k < 3; k++)
            tint += passed(ways[i].shadows, true, k) / 3;
        assert_true(fabs((double)at(&image, pane_shadow)[3] - (1 - tint)) < 2e-4);
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

/* Auxiliary outputs, picks and the objects themselves know nothing of it. */
static void nothing_else_changes(void **state)
{
    struct rig_scene rig;
    struct error err = {0};
    open_block_and_pane(&rig, *state);
    struct view view = look(SHADOWS_DEEP, 2), bare;
    view.camera.ortho_height = 0; /* whose near and far planes enclose the ground */
    bare = view;
    view.outputs = bare.outputs = (1u << VIEW_OUTPUT_COUNT) - 1;
    bare.ground_plane.is_shown = false;
    struct frame with, without;
    shoot(*state, &rig, &view, &with);
    shoot(*state, &rig, &bare, &without);
    for (int output = VIEW_OUTPUT_COLOR + 1; output < VIEW_OUTPUT_COUNT; output++)
        if (memcmp(with.outputs[output].pixels, without.outputs[output].pixels,
                   image_size_bytes(&with.outputs[output])) != 0)
            fail_msg("output %d has other bits", output);
    static const double on_block[3] = {-1, 1.2, 0};
    const float *pixel = image_at(&with.outputs[VIEW_OUTPUT_COLOR], &view, on_block);
    for (int k = 0; k < 4; k++)
        assert_true(pixel[k] == image_at(&without.outputs[VIEW_OUTPUT_COLOR], &view, on_block)[k]);
    frame_finish(&with);
    frame_finish(&without);
    double at_block[2];
    assert_true(view_project(&view, on_block, at_block));
    const struct pick_desc places[2] = {{.x = 12, .y = 12},
                                        {.x = (int)at_block[0], .y = (int)at_block[1]}};
    for (size_t i = 0; i < 2; i++) {
        struct pick_result result;
        if (!renderer_pick(*state, rig.key, &view, &places[i], &result, &err))
            fail_msg("%s", err.message);
        assert_int_equal(result.layer_count, i);
        pick_result_finish(&result);
    }
    rig_scene_finish(&rig, *state);
}

/* A clip plane cuts the objects and lets light in, and leaves the ground whole. */
static void planes_do_not_cut_it(void **state)
{
    static const double right_half[1][4] = {{1, 0, 0, 0}};
    static const struct view_cut spares[1] = {{.spares_shadows = true}};
    struct rig_scene rig;
    open_block_and_pane(&rig, *state);
    for (size_t i = 0; i < sizeof ways / sizeof *ways - 1; i++) {
        struct view view = look(ways[i].shadows, 1);
        view.quality.reference = ways[i].reference;
        view.clip_planes = right_half;
        view.clip_plane_count = 1;
        struct image cut = shoot_color(*state, &rig, &view);
        view.cuts = spares;
        struct image spared = shoot_color(*state, &rig, &view);
        for (int k = 0; k < 3; k++) {
            assert_true(fabsf(at(&cut, block_shadow)[k] - behind[k]) < 1e-5f);
            assert_true(at(&spared, block_shadow)[k] < 1e-5f);
        }
        image_finish(&cut);
        image_finish(&spared);
    }
    rig_scene_finish(&rig, *state);
}

/* A camera that moves, and the plane itself, build no shadow anew. */
static void shadows_stand(void **state)
{
    struct rig_scene rig;
    open_block_and_pane(&rig, *state);
    struct view view = look(SHADOWS_DEEP, 1);
    view.ground_plane.is_shown = false;
    struct frame frame;
    for (int step = 0; step < 3; step++) {
        shoot(*state, &rig, &view, &frame);
        assert_int_equal(frame.report.counts.shadow_maps_built, step == 0);
        frame_finish(&frame);
        view.ground_plane.is_shown = true;
        view.camera.eye[0] = 0.5 * step;
    }
    rig_scene_finish(&rig, *state);
}

/* From below, and beyond its reach, there is none. */
static void it_ends_without_an_edge(void **state)
{
    struct rig_scene rig;
    open_block_and_pane(&rig, *state);
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        struct view view = look(ways[i].shadows, 1);
        view.quality.reference = ways[i].reference;
        view.camera.eye[1] = -8;
        struct image below = shoot_color(*state, &rig, &view);
        for (int k = 0; k < 3; k++)
            assert_true(at(&below, pane_shadow)[k] == behind[k]);
        image_finish(&below);
        /* to the horizon */
        view = look(ways[i].shadows, 1);
        view.quality.reference = ways[i].reference;
        view.camera = (struct view_camera){
            .kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 4, 16}, .target = {0, 3, 0}};
        struct image far = shoot_color(*state, &rig, &view);
        for (int x = 0; x < SIZE; x++)
            for (int y = 0; y < SIZE; y += y == 0 ? SIZE / 2 - 4 : 1) {
                const float *pixel = image_pixel_f32(&far, x, y);
                if (y < SIZE / 2)
                    for (int k = 0; k < 3; k++)
                        assert_true(fabsf(pixel[k] - behind[k]) < 1e-5f);
            }
        image_finish(&far);
    }
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_background_is_darkened_by_the_share_of_light),
        cmocka_unit_test(many_lights_in_parts_are_one),
        cmocka_unit_test(light_of_a_map_has_its_shadow_by_rays),
        cmocka_unit_test(a_transparent_picture_has_its_shadow_as_alpha),
        cmocka_unit_test(nothing_else_changes),
        cmocka_unit_test(planes_do_not_cut_it),
        cmocka_unit_test(shadows_stand),
        cmocka_unit_test(it_ends_without_an_edge),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

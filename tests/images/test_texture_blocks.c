/* SPDX-License-Identifier: MIT */
/* Colours in blocks where the budget of textures is exceeded: nearer to the picture of all levels
 * than withheld levels where these would be seen, and the same bits again after frames in motion.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/accuracy/flip.h"
#include "renderer/frame/texture_speed.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/image_checks.h"

enum { MIB = 1 << 20 };

/* from_levels: that would be withheld else; 0: never. */
static struct renderer *open_renderer(uint64_t budget, uint32_t from_levels)
{
    struct renderer *renderer = render_rig_create_as(&(struct renderer_desc){
        .is_strict = true, .texture_budget_bytes = budget, .texture_upload_ms = 1000});
    renderer_set_texture_compression(renderer, from_levels);
    return renderer;
}

static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {0.15, -1, 0.12},
                                      .color = {1, 1, 1},
                                      .intensity = 5,
                                      .casts_no_shadow = true};

static struct view view_of_wall(void)
{
    return (struct view){.width_px = 1280,
                         .height_px = 720,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {-5, 1.2, -2.4},
                                    .target = {-4, 1, -4},
                                    .fov_y_deg = 60},
                         .lights = &sun,
                         .light_count = 1,
                         .quality = {.shadows = SHADOWS_MAP, .samples = 1}};
}

/* In motion until nothing is to come, then at rest. */
static void settle(struct renderer *renderer, struct rig_scene *rig, struct frame *frame)
{
    struct view view = view_of_wall();
    view.quality.may_be_coarse = true;
    bool is_done = false;
    for (int i = 0; i < 400 && !is_done; i++) {
        shoot(renderer, rig, &view, frame);
        assert_true(frame->report.textures.resident_bytes <= frame->report.textures.budget_bytes);
        is_done = !frame->report.textures.pending_bytes;
        frame_finish(frame);
    }
    assert_true(is_done);
    view.quality.may_be_coarse = false;
    shoot(renderer, rig, &view, frame);
}

static double flip_of(const struct frame *frame, const struct frame *reference)
{
    struct flip flip;
    struct error err = {0};
    if (!flip_measure(&(struct flip_desc){.image = &frame->outputs[VIEW_OUTPUT_COLOR],
                                          .reference = &reference->outputs[VIEW_OUTPUT_COLOR]},
                      &flip, NULL, &err))
        fail_msg("%s", err.message);
    return flip.mean;
}

struct distance {
    double rmse, flip;
};

static struct distance measure(uint64_t budget, uint32_t from_levels, bool compresses,
                               const struct frame *reference)
{
    struct renderer *renderer = open_renderer(budget, from_levels);
    struct rig_scene rig;
    struct frame first, again;
    struct view view = view_of_wall();
    rig_asset_open(&rig, renderer, "Sponza/glTF/Sponza.gltf");
    shoot(renderer, &rig, &view, &first);
    settle(renderer, &rig, &again);
    const struct report_textures *t = &again.report.textures;
    assert_same_bits(&first.outputs[VIEW_OUTPUT_COLOR], &again.outputs[VIEW_OUTPUT_COLOR]);
    assert_int_equal(t->compressed_count > 0, compresses);
    assert_int_equal(t->compressed_bytes > 0, compresses);
    assert_int_equal(t->compressed_rmse > 0.001 && t->compressed_rmse < 0.03, compresses);
    assert_true(t->resident_bytes <= budget && t->wanted_bytes > budget);
    struct distance distance = {
        extreme_rmse(&again.outputs[VIEW_OUTPUT_COLOR], &reference->outputs[VIEW_OUTPUT_COLOR]),
        flip_of(&again, reference)};
    print_message("%.2f MiB of %.1f, %s: relative RMSE %.5f, FLIP %.5f; bias %llu, %llu compressed "
                  "(%.1f MiB, RMSE %.4f), %.0f ms\n",
                  (double)budget / MIB, (double)t->wanted_bytes / MIB,
                  compresses ? "colours compressed" : "levels withheld", distance.rmse,
                  distance.flip, (unsigned long long)t->level_bias,
                  (unsigned long long)t->compressed_count, (double)t->compressed_bytes / MIB,
                  t->compressed_rmse, first.report.textures.upload_ms);
    frame_finish(&first);
    frame_finish(&again);
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
    return distance;
}

/* A wall from near, with a thirtieth of what it samples: levels are withheld that would be seen;
 * `auto` compresses where there is far less. */
static void compressed_colours_are_nearer_than_levels_withheld_that_would_be_seen(void **state)
{
    (void)state;
    struct renderer *renderer = open_renderer(0, 1);
    struct rig_scene rig;
    struct frame reference;
    struct view view = view_of_wall();
    rig_asset_open(&rig, renderer, "Sponza/glTF/Sponza.gltf");
    shoot(renderer, &rig, &view, &reference);
    assert_int_equal(reference.report.textures.compressed_count, 0);
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
    struct distance withheld = measure(6 * MIB, TEXTURE_SPEED_AUTO_LEVELS, false, &reference);
    struct distance compressed = measure(6 * MIB, 1, true, &reference);
    assert_true(compressed.rmse < 0.8 * withheld.rmse);
    withheld = measure(MIB / 4, 0, false, &reference); /* a 700th */
    compressed = measure(MIB / 4, TEXTURE_SPEED_AUTO_LEVELS, true, &reference);
    assert_true(compressed.rmse < 0.9 * withheld.rmse && compressed.flip < withheld.flip);
    frame_finish(&reference);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(compressed_colours_are_nearer_than_levels_withheld_that_would_be_seen),
    };
    if (!assets_are_present())
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}

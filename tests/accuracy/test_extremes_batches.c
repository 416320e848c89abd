/* SPDX-License-Identifier: MIT */
/* More shadowed lights than the memory of their shadows holds: made and used in batches, with the
 * bits of all at once, and said so. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/extreme_scene.h"
#include "tests/support/image_checks.h"

enum { LIGHTS_MAX = 240 };

/* Spots, every third a cube of six faces, every seventh without shadow, every eleventh without a
 * range, so that it is in the prefix of all light lists. */
static void place_lights(struct view_light *lights, int count)
{
    for (int i = 0; i < count; i++) {
        double a = 0.61 * i, r = 0.6 + 0.004 * i;
        lights[i] = (struct view_light){
            .type = i % 3 ? SCENE_LIGHT_SPOT : SCENE_LIGHT_POINT,
            .position = {r * cos(a), 2.2 + 0.1 * (i % 9), r * sin(a)},
            .direction = {-0.2 * cos(a), -1, -0.2 * sin(a)},
            .color = {1, 0.9f - 0.05f * (float)(i % 5), 0.7f},
            .intensity = 3,
            .range = i % 11 ? 6 : 0,
            .outer_cone_deg = 35,
            .casts_no_shadow = i % 7 == 6,
        };
    }
}

struct shot {              /* of the extreme scene under many lights */
    uint64_t budget_bytes; /* of the renderer; half of it is for shadows */
    int lights, resolution, width, height;
    bool has_crossing_panes; /* in its place */
    struct view_quality quality;
};

static void open_crossing_panes(struct extreme_scene *scene, struct renderer *renderer)
{
    struct closed_form_scene panes;
    random_panes_scene_build(
        &(struct random_panes_scene_desc){.pane_count = 12, .seed = 9, .light = GLB_LIGHT_POINT},
        &panes);
    rig_scene_finish(&scene->rig, renderer);
    rig_scene_open(&scene->rig, renderer, "panes", panes.glb, panes.size_bytes);
    closed_form_scene_finish(&panes);
    scene->view.camera = (struct view_camera){.kind = VIEW_CAMERA_NODE, .node = "Floor"};
    scene->view.ignore_scene_lights = true;
}

/* The pixels are the caller's. False when refused. */
static bool take(const struct shot *shot, struct image *picture, struct frame_report *report,
                 struct error *err)
{
    static struct view_light lights[LIGHTS_MAX];
    struct renderer *renderer = renderer_create(
        &(struct renderer_desc){.gpu_budget_bytes = shot->budget_bytes, .is_strict = true}, err);
    struct extreme_scene scene;
    struct frame frame;
    if (!renderer && err->code == ERROR_NO_DEVICE)
        skip();
    assert_non_null(renderer);
    place_lights(lights, shot->lights);
    extreme_scene_open(&scene, renderer, "batches", &(struct extreme_desc){0});
    if (shot->has_crossing_panes)
        open_crossing_panes(&scene, renderer);
    scene.view.quality = shot->quality;
    scene.view.quality.shadow_resolution = shot->resolution;
    scene.view.lights = lights;
    scene.view.light_count = (size_t)shot->lights;
    scene.view.width_px = shot->width ? shot->width : 96;
    scene.view.height_px = shot->height ? shot->height : 72;
    bool is_made = false;
    for (int i = 0; i < 2; i++) { /* the second frame knows what fits */
        is_made = renderer_render(renderer, scene.rig.key, &scene.view, &frame, err);
        if (!is_made)
            break;
        if (i == 1) {
            assert_memory_equal(picture->pixels, frame.outputs[VIEW_OUTPUT_COLOR].pixels,
                                image_size_bytes(picture));
            image_finish(picture);
        }
        *picture = frame.outputs[VIEW_OUTPUT_COLOR];
        *report = frame.report;
        frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
        frame_finish(&frame);
    }
    extreme_scene_finish(&scene, renderer);
    renderer_destroy(renderer);
    return is_made;
}

static uint64_t shadow_bytes(const struct frame_report *report)
{
    return report_bytes_of(report, "shadow.");
}

/* Values of other bits in the picture within `budget_bytes`, which must take several batches. */
static void compare(const char *name, struct shot shot, uint64_t budget_bytes, double tolerance)
{
    struct image ample = {0}, tight = {0};
    struct frame_report report[2] = {0};
    struct error err = {0};
    assert_true(take(&shot, &ample, &report[0], &err));
    assert_int_equal(report[0].counts.light_batches, 1);
    shot.budget_bytes = budget_bytes;
    if (!take(&shot, &tight, &report[1], &err))
        fail_msg("%s", err.message);
    print_message("%s: %llu batches, %llu events in all, %llu MB instead of %llu MB\n", name,
                  (unsigned long long)report[1].counts.light_batches,
                  (unsigned long long)report[1].counts.events,
                  (unsigned long long)shadow_bytes(&report[1]) >> 20,
                  (unsigned long long)shadow_bytes(&report[0]) >> 20);
    assert_true(report[1].counts.light_batches > 2);
    assert_true(shadow_bytes(&report[1]) > 0);
    assert_true(shadow_bytes(&report[1]) < shadow_bytes(&report[0]));
    assert_true(shadow_bytes(&report[1]) <= budget_bytes / 2);
    assert_int_equal(report[1].counts.events, report[0].counts.events);
    assert_int_equal(report[1].counts.shadowed_lights, report[0].counts.shadowed_lights);
    assert_int_equal(report[1].counts.lookups, report[0].counts.lookups);
    assert_true(report_has_warning(&report[1], "batches"));
    for (int i = 0; i < report[0].warning_count; i++)
        assert_true(report_has_warning(&report[1], report[0].warnings[i]));
    assert_int_equal(report[1].warning_count, report[0].warning_count + 1);
    extreme_expect(&(struct extreme_row){name, "deep", "RMSE, relative", tolerance},
                   extreme_rmse(&tight, &ample));
    if (tolerance == 0)
        assert_memory_equal(tight.pixels, ample.pixels, image_size_bytes(&ample));
    image_finish(&ample);
    image_finish(&tight);
}

static void batches_of_lights_give_the_bits_of_all_at_once(void **state)
{
    (void)state;
    struct shot shot = {.lights = 24, .resolution = 256};
    compare("24 lights in batches", shot, 24 << 20, 0);
    shot.quality.samples = 1;
    shot.quality.shadows = SHADOWS_DEEP_LINKED;
    compare("24 lights in batches, linked shadows", shot, 32 << 20, 0);
    shot.quality.shadows = SHADOWS_COMPOSITED;
    shot.has_crossing_panes = true;
    shot.resolution = 128;
    compare("24 lights in batches, composited shadows", shot, 40 << 20, 0);
    shot.has_crossing_panes = false;
    shot.resolution = 256;
    shot.quality.shadows = SHADOWS_AUTO;
    shot.quality.light_lists = VIEW_LIGHT_LISTS_LINKED;
    compare("24 lights in batches, linked light lists", shot, 24 << 20, 1e-6);
}

/* Each window goes through all batches. */
static void windows_and_batches_go_together(void **state)
{
    (void)state;
    struct shot shot = {.lights = 12, .resolution = 256, .width = 4200, .height = 24};
    shot.quality.samples = 1;
    compare("12 lights in batches, two windows", shot, 32 << 20, 0);
}

static void hundreds_of_shadowed_lights_stay_within_their_memory(void **state)
{
    (void)state;
    struct shot shot = {.lights = LIGHTS_MAX, .resolution = 128};
    compare("240 lights in batches", shot, 32 << 20, 0);
}

static void one_light_beyond_the_budget_is_refused_with_both_numbers(void **state)
{
    (void)state;
    struct shot shot = {.lights = 8, .resolution = 1024, .budget_bytes = 32 << 20};
    struct image picture = {0};
    struct frame_report report;
    struct error err = {0};
    assert_false(take(&shot, &picture, &report, &err));
    print_message("refused: %s\n", err.message);
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "16777216"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(batches_of_lights_give_the_bits_of_all_at_once),
        cmocka_unit_test(windows_and_batches_go_together),
        cmocka_unit_test(hundreds_of_shadowed_lights_stay_within_their_memory),
        cmocka_unit_test(one_light_beyond_the_budget_is_refused_with_both_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

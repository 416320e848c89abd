/* SPDX-License-Identifier: MIT */
/* Devices that can do less than our own: storage blocks of 1 MiB, buffer textures of 65,536 texels,
 * no post-depth coverage, timers that lie. A frame has the picture that it has elsewhere, or is
 * refused with the limit that it meets; nothing is bound that the device has not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/gl_hooks.h"
#include "tests/support/image_checks.h"

static const struct {
    const char *name;
    int width_px, height_px;
    struct view_quality quality;
    bool is_large; /* a small device refuses it */
} shots[] = {
    {"deep", 64, 48, {.shadow_resolution = 32}, false},
    {"deep-linked", 64, 48, {.shadow_resolution = 16, .shadows = SHADOWS_DEEP_LINKED}, false},
    {"translucent", 32, 24, {.shadow_resolution = 16, .shadows = SHADOWS_TRANSLUCENT}, false},
    {"raytraced-shadows", 32, 24, {.shadows = SHADOWS_RAYTRACED_SHADOWS}, false},
    {"linked light lists",
     64,
     48,
     {.shadow_resolution = 32, .light_lists = VIEW_LIGHT_LISTS_LINKED},
     false},
    {"4 samples in many windows", 480, 320, {.shadow_resolution = 32, .samples = 4}, false},
    {"shadow maps of 1024", 64, 48, {.shadow_resolution = 1024}, true},
};
enum { SHOTS = sizeof shots / sizeof *shots };

/* One picture of each, empty where it was refused for want of room. */
static void shoot_all(const struct gl_hostility *hostility, struct image pictures[SHOTS],
                      bool *has_true_timers)
{
    struct rig_scene demo;
    struct renderer_info info;
    gl_hooks_install(&(struct gl_hooks_desc){.hostility = *hostility});
    struct renderer *renderer = render_rig_create();
    renderer_get_info(renderer, &info);
    *has_true_timers = info.has_true_timers;
    rig_demo_open(&demo, renderer, "demo", 64);
    for (int i = 0; i < SHOTS; i++) {
        struct frame frame = {0};
        struct error err = {0};
        const struct view view = {
            .width_px = shots[i].width_px,
            .height_px = shots[i].height_px,
            .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}},
            .quality = shots[i].quality};
        if (renderer_render(renderer, demo.key, &view, &frame, &err)) {
            pictures[i] = frame.outputs[VIEW_OUTPUT_COLOR];
            frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
        } else {
            print_message("%s: %s\n", shots[i].name, err.message);
            assert_int_equal(err.code, ERROR_OVER_BUDGET);
        }
        frame_finish(&frame);
    }
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
    gl_hooks_install(&(struct gl_hooks_desc){.counts = false});
}

static void finish(struct image pictures[SHOTS])
{
    for (int i = 0; i < SHOTS; i++)
        image_finish(&pictures[i]);
}

static void expect_no_fault(void)
{
    char text[1024];
    if (gl_faults_take(text, sizeof text))
        fail_msg("%s", text);
}

/* In several windows edges may fall on the other side of a sample, as images.window_budget has it.
 */
static void expect_same(int shot, const struct image *ours, const struct image *small)
{
    if (shots[shot].quality.samples == 4)
        assert_true(image_share_differing(ours, small, 1e-2, 1e-2) < 2e-3);
    else
        assert_same_bits(ours, small);
}

static void small_limits_give_the_same_pictures_or_are_named(void **state)
{
    struct image ours[SHOTS] = {{0}}, small[SHOTS] = {{0}};
    bool has_true_timers;
    (void)state;
    shoot_all(&(struct gl_hostility){.reuses_names = true}, ours, &has_true_timers);
    shoot_all(&(struct gl_hostility){.has_small_blocks = true, .has_small_texels = true}, small,
              &has_true_timers);
    expect_no_fault();
    for (int i = 0; i < SHOTS; i++) {
        assert_non_null(ours[i].pixels);
        if (!small[i].pixels != shots[i].is_large)
            fail_msg("%s: refused: %d", shots[i].name, !small[i].pixels);
        if (small[i].pixels)
            expect_same(i, &ours[i], &small[i]);
    }
    finish(ours);
    finish(small);
}

/* On one device: programs for others are others, and compilers may round them otherwise. */
static void lying_timers_change_no_picture(void **state)
{
    struct image ours[SHOTS] = {{0}}, lying[SHOTS] = {{0}};
    bool has_true_timers;
    (void)state;
    shoot_all(&(struct gl_hostility){.timers = GL_TIMERS_TRUE, .is_not_software = true}, ours,
              &has_true_timers);
    shoot_all(&(struct gl_hostility){.timers = GL_TIMERS_FALSE, .is_not_software = true}, lying,
              &has_true_timers);
    assert_false(has_true_timers);
    for (int i = 0; i < SHOTS; i++)
        assert_same_bits(&ours[i], &lying[i]);
    finish(ours);
    finish(lying);
}

/* Its shaders may not ask for the extension, and pictures of one sample need none. */
static void without_post_depth_coverage_frames_are_drawn(void **state)
{
    struct image ours[SHOTS] = {{0}}, without[SHOTS] = {{0}};
    bool has_true_timers;
    (void)state;
    shoot_all(&(struct gl_hostility){0}, ours, &has_true_timers);
    shoot_all(&(struct gl_hostility){.lacks_post_coverage = true}, without, &has_true_timers);
    expect_no_fault();
    for (int i = 0; i < SHOTS; i++)
        if (shots[i].quality.samples != 4)
            assert_same_bits(&ours[i], &without[i]);
        else
            assert_image_is_sound(&without[i], 1e6);
    finish(ours);
    finish(without);
}

int main(void)
{
    setenv("VITRAIL_WIDE_FLOATS", "f64", false); /* or busy processors decide between the forms */
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_limits_give_the_same_pictures_or_are_named),
        cmocka_unit_test(lying_timers_change_no_picture),
        cmocka_unit_test(without_post_depth_coverage_frames_are_drawn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

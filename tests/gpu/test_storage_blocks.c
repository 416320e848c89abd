/* SPDX-License-Identifier: MIT */
/* No storage block is larger than the device says it may be: on one that gives 1 MiB pictures are
 * those of this device, in more windows, or frames are refused by number. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/extreme_checks.h"
#include "tests/support/gl_hooks.h"
#include "tests/support/image_checks.h"

enum { BLOCK_BYTES = 1 << 20, WIDTH_PX = 320, HEIGHT_PX = 180 };

/* Layers that stand already stay. */
static void set_small_blocks(bool has_small_blocks)
{
    struct gl_hooks_desc desc = *gl_hooks_installed();
    desc.hostility.has_small_blocks = has_small_blocks;
    gl_hooks_install(&desc);
}

static int stand_between(void **unused)
{
    (void)unused;
    set_small_blocks(true);
    return 0;
}

static int step_aside(void **unused)
{
    (void)unused;
    set_small_blocks(false);
    return 0;
}

/* No storage block was larger than the device has them. */
static void expect_none_too_large(void)
{
    char text[512];
    if (gl_faults_take(text, sizeof text))
        fail_msg("%s", text);
}

struct fixture {
    struct renderer *renderer;
    struct rig_scene demo;
};

static void fixture_init(struct fixture *fixture, bool is_hardware)
{
    fixture->renderer =
        render_rig_create_as(&(struct renderer_desc){.hooks.poses_as_hardware = is_hardware});
    rig_demo_open(&fixture->demo, fixture->renderer, "demo", 128);
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

static bool take(struct fixture *fixture, const struct view *view, struct frame *frame,
                 struct error *err)
{
    bool is_made = renderer_render(fixture->renderer, fixture->demo.key, view, frame, err);
    print_message("shadows %d, outputs %x: %s\n", (int)view->quality.shadows, view->outputs,
                  err->message);
    return is_made;
}

/* A picture of the one device and of the other. */
struct pair {
    struct frame ample, tight;
};

static void take_pair_on(bool is_hardware, const struct view *view, struct pair *pair)
{
    for (int is_tight = 0; is_tight < 2; is_tight++) {
        struct fixture fixture;
        struct error err = {0};
        set_small_blocks(is_tight);
        fixture_init(&fixture, is_hardware);
        bool is_made = take(&fixture, view, is_tight ? &pair->tight : &pair->ample, &err);
        fixture_finish(&fixture);
        if (!is_made)
            fail_msg("%s", err.message);
    }
    set_small_blocks(false);
    expect_none_too_large();
}

static void take_pair(const struct view *view, struct pair *pair)
{
    take_pair_on(false, view, pair);
}

static void pair_finish(struct pair *pair)
{
    frame_finish(&pair->ample);
    frame_finish(&pair->tight);
}

static void windows_keep_lists_and_points_within_a_block(void **unused)
{
    (void)unused;
    static const enum shadow_technique techniques[] = {SHADOWS_NONE, SHADOWS_RAYTRACED_SHADOWS};
    for (int i = 0; i < 2; i++) {
        struct pair pair;
        const struct view view = {.width_px = WIDTH_PX,
                                  .height_px = HEIGHT_PX,
                                  .quality = {.shadows = techniques[i], .samples = 4}};
        take_pair(&view, &pair);
        const struct image *a = &pair.tight.outputs[VIEW_OUTPUT_COLOR],
                           *b = &pair.ample.outputs[VIEW_OUTPUT_COLOR];
        print_message("RMSE, relative: %.2g\n", extreme_rmse(a, b));
        assert_true(extreme_rmse(a, b) < 1e-2);
        assert_true(image_share_differing(a, b, 1e-2, 1e-2) < 2e-3);
        pair_finish(&pair);
    }
}

/* Numbers of layers, too, which windows do not change but for edges. */
static void outputs_are_written_within_a_block(void **unused)
{
    (void)unused;
    struct pair pair;
    struct view view = {
        .width_px = WIDTH_PX, .height_px = HEIGHT_PX, .quality.shadows = SHADOWS_NONE};
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        view.outputs |= 1u << i;
    take_pair(&view, &pair);
    const struct image *a = &pair.tight.outputs[VIEW_OUTPUT_LAYERS],
                       *b = &pair.ample.outputs[VIEW_OUTPUT_LAYERS];
    const uint32_t *x = a->pixels, *y = b->pixels;
    int differing = 0;
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++)
        differing += x[i] != y[i];
    print_message("%d pixels of other numbers of layers\n", differing);
    assert_true(differing < WIDTH_PX * HEIGHT_PX / 500);
    pair_finish(&pair);
}

/* Lights that do not fit together: each has less than a block, and all far more. */
static void shadows_of_many_lights_are_built_within_a_block(void **unused)
{
    (void)unused;
    enum { LIGHTS = 12 };
    static const enum shadow_technique techniques[] = {SHADOWS_DEEP, SHADOWS_DEEP_LINKED,
                                                       SHADOWS_DEEP};
    struct view_light lights[LIGHTS];
    for (int i = 0; i < LIGHTS; i++)
        lights[i] = (struct view_light){.type = SCENE_LIGHT_POINT,
                                        .position = {0.3 * i - 1.5, 1.5 + 0.1 * i, 0.2},
                                        .color = {1, 1, 1},
                                        .intensity = 5};
    for (int i = 0; i < 3; i++) {
        struct pair pair;
        const struct view view = {.width_px = 64,
                                  .height_px = 48,
                                  .lights = lights,
                                  .light_count = LIGHTS,
                                  .ignore_scene_lights = true,
                                  .quality = {.shadows = techniques[i],
                                              .shadow_compression = i == 2 ? 0.01 : 0,
                                              .shadow_resolution = 96,
                                              .samples = 1}};
        take_pair(&view, &pair);
        const struct image *a = &pair.tight.outputs[VIEW_OUTPUT_COLOR],
                           *b = &pair.ample.outputs[VIEW_OUTPUT_COLOR];
        assert_same_bits(a, b);
        print_message("%llu events\n", (unsigned long long)pair.tight.report.counts.events);
        assert_true(pair.tight.report.counts.events * 16 > BLOCK_BYTES || i == 2);
        pair_finish(&pair);
    }
}

static const struct view_light lamp = {
    .type = SCENE_LIGHT_POINT, .position = {0, 1.5, 0.2}, .color = {1, 1, 1}, .intensity = 5};

static struct view lit_view(enum shadow_technique shadows, int resolution)
{
    return (struct view){
        .width_px = 64,
        .height_px = 48,
        .lights = &lamp,
        .light_count = 1,
        .ignore_scene_lights = true,
        .quality = {.shadows = shadows, .shadow_resolution = resolution, .samples = 1}};
}

/* Beside three others that fit into one: in rows of its faces. At 256 texels its counts do not fit,
 * at 640 the lists of some light do not, either; rays of compressed maps are counted like others.
 */
static void a_light_beyond_a_block_keeps_its_bits(void **unused)
{
    (void)unused;
    enum { LIGHTS = 4 };
    struct view_light lights[LIGHTS];
    for (int i = 0; i < LIGHTS; i++) {
        lights[i] = lamp;
        lights[i].type = i == 1 ? SCENE_LIGHT_POINT : SCENE_LIGHT_SPOT;
        lights[i].direction[0] = 0.2 * i - 0.3;
        lights[i].direction[1] = -1;
        lights[i].position[0] = 0.4 * (i - 1);
    }
    static const struct {
        int resolution;
        double compression;
        int prefilter;
    } maps[] = {{256, 0, 0}, {640, 0, 0}, {192, 0.05, 2}};
    for (int i = 0; i < 6; i++) {
        struct pair pair;
        struct view view = lit_view(SHADOWS_DEEP, maps[i / 2].resolution);
        view.lights = lights;
        view.light_count = LIGHTS;
        view.quality.shadow_compression = maps[i / 2].compression;
        view.quality.shadow_prefilter = maps[i / 2].prefilter;
        take_pair_on(i % 2, &view, &pair);
        assert_same_bits(&pair.tight.outputs[VIEW_OUTPUT_COLOR],
                         &pair.ample.outputs[VIEW_OUTPUT_COLOR]);
        uint64_t events = pair.tight.report.counts.events;
        print_message("%llu events\n", (unsigned long long)events);
        assert_int_equal(pair.ample.report.counts.events, events);
        assert_true(maps[i / 2].resolution < 640 || events * 16 > LIGHTS * BLOCK_BYTES);
        pair_finish(&pair);
    }
}

/* What is written in no order, or in no parts. */
static void a_light_beyond_a_block_of_other_structures_is_refused_by_number(void **unused)
{
    (void)unused;
    static const struct {
        enum shadow_technique shadows;
        int resolution;
        double compression;
        const char *reason;
    } cases[] = {
        {SHADOWS_DEEP_LINKED, 256, 0, "light 0 needs "},
        {SHADOWS_DEEP_LINKED, 384, 0, "light 0 needs 3538944 bytes of 'shadow.heads'"},
        {SHADOWS_DEEP, 384, 0.05, "light 0 needs 3538948 bytes of 'shadow.heads'"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct view view = lit_view(cases[i].shadows, cases[i].resolution);
        struct fixture fixture;
        struct frame frame;
        struct error err = {0};
        view.quality.shadow_compression = cases[i].compression;
        fixture_init(&fixture, false);
        assert_false(take(&fixture, &view, &frame, &err));
        assert_int_equal(err.code, ERROR_OVER_BUDGET);
        assert_non_null(strstr(err.message, cases[i].reason));
        assert_non_null(strstr(err.message, "in one storage block, this device has 1048576"));
        assert_non_null(strstr(err.message, "lower quality.shadow_resolution"));
        view.quality.shadow_resolution = 64;
        err = (struct error){0};
        if (!take(&fixture, &view, &frame, &err))
            fail_msg("%s", err.message);
        frame_finish(&frame);
        fixture_finish(&fixture);
        expect_none_too_large();
    }
}

static void linked_light_lists_beyond_a_block_are_refused_by_number(void **unused)
{
    (void)unused;
    enum { LIGHTS = 64 };
    struct view_light lights[LIGHTS];
    for (int i = 0; i < LIGHTS; i++)
        lights[i] = (struct view_light){.type = SCENE_LIGHT_POINT,
                                        .position = {0.1 * i - 3, 1, 0},
                                        .color = {1, 1, 1},
                                        .intensity = 1,
                                        .range = 30,
                                        .casts_no_shadow = true};
    const struct view view = {
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .lights = lights,
        .light_count = LIGHTS,
        .quality = {.shadows = SHADOWS_NONE, .light_lists = VIEW_LIGHT_LISTS_LINKED}};
    struct fixture fixture;
    struct frame frame;
    struct error err = {0};
    fixture_init(&fixture, false);
    assert_false(take(&fixture, &view, &frame, &err));
    fixture_finish(&fixture);
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "the limit is 65536"));
    expect_none_too_large();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(windows_keep_lists_and_points_within_a_block),
        cmocka_unit_test(outputs_are_written_within_a_block),
        cmocka_unit_test(shadows_of_many_lights_are_built_within_a_block),
        cmocka_unit_test(a_light_beyond_a_block_keeps_its_bits),
        cmocka_unit_test_setup_teardown(
            a_light_beyond_a_block_of_other_structures_is_refused_by_number, stand_between,
            step_aside),
        cmocka_unit_test_setup_teardown(linked_light_lists_beyond_a_block_are_refused_by_number,
                                        stand_between, step_aside),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* How often a frame waits for a graphics device: the processor's commands and the device's work go
 * on side by side, and stop for each other where a number has to come back. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stddef.h>

#include <cmocka.h>

#include "tests/support/gl_counts.h"
#include "tests/support/image_checks.h"

/* A device of its own, with true timers, on which nothing is there before it is waited for. */
struct stage {
    struct renderer *renderer;
    struct rig_scene demo;
    struct view view;
    struct view_light lamps[2];
};

static void stage_begin(struct stage *stage)
{
    *stage = (struct stage){.renderer = NULL};
    gl_hooks_install(&(struct gl_hooks_desc){
        .counts = true, .hostility = {.is_not_software = true, .timers = GL_TIMERS_TRUE}});
    stage->renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.defers_frames = true});
    rig_demo_open(&stage->demo, stage->renderer, "demo", 64);
    for (int i = 0; i < 2; i++)
        stage->lamps[i] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                              .position = {2 - 4 * i, 5, 3},
                                              .direction = {-0.3, -1, -0.5},
                                              .color = {1, 1, 1},
                                              .intensity = 800};
    stage->view = (struct view){
        .width_px = 64,
        .height_px = 40,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}},
        .lights = stage->lamps,
        .light_count = 2,
        .screen = {.channels = 4},
        .quality = {.shadows = SHADOWS_DEEP, .shadow_resolution = 64}};
}

static void stage_end(struct stage *stage)
{
    rig_scene_finish(&stage->demo, stage->renderer);
    renderer_destroy(stage->renderer);
    gl_hooks_install(&(struct gl_hooks_desc){.counts = false});
}

static struct gl_counts count_frame(struct stage *stage, struct frame *frame)
{
    struct gl_counts before, after;
    gl_counts_get(&before);
    shoot(stage->renderer, &stage->demo, &stage->view, frame);
    gl_counts_get(&after);
    return gl_counts_between(&before, &after);
}

static void expect_waits(struct stage *stage, uint64_t most, const char *what)
{
    struct frame frame;
    const struct gl_counts counts = count_frame(stage, &frame);
    uint64_t waits = gl_counts_waits(&counts);
    assert_true(frame.report.counts.transparent_fragments > 0);
    assert_int_equal(IMAGE_U8, frame.outputs[VIEW_OUTPUT_COLOR].component);
    frame_finish(&frame);
    if (waits > most)
        fail_msg("%s: %llu waits", what, (unsigned long long)waits);
}

/* Nobody knows how large any list is: the sizes of shadows and of layers come at once, and then the
 * picture. */
static void the_first_picture_of_a_scene_waits_twice(void **state)
{
    struct stage stage;
    struct frame first, second;
    (void)state;
    stage_begin(&stage);
    const struct gl_counts counts = count_frame(&stage, &first);
    assert_int_equal(2, gl_counts_waits(&counts));
    assert_true(first.report.counts.events > 0);
    assert_true(first.report.counts.transparent_fragments > 0);
    assert_int_equal(1, first.report.counts.gbuffers_drawn);
    assert_int_equal(0, first.report.counts.gbuffers_reused);
    renderer_drop_structures(stage.renderer, stage.demo.key);
    shoot(stage.renderer, &stage.demo, &stage.view, &second);
    assert_same_bits(&first.outputs[VIEW_OUTPUT_COLOR], &second.outputs[VIEW_OUTPUT_COLOR]);
    assert_int_equal(first.report.counts.events, second.report.counts.events);
    assert_int_equal(first.report.counts.transparent_fragments,
                     second.report.counts.transparent_fragments);
    frame_finish(&first);
    frame_finish(&second);
    stage_end(&stage);
}

/* Of another size, with linear output, with other lamps, and with outputs beside the colour. */
static void other_views_of_a_scene_wait_twice_at_most(void **state)
{
    struct stage stage;
    struct frame frame;
    (void)state;
    stage_begin(&stage);
    expect_waits(&stage, 2, "the first frame");
    stage.view.camera.eye[0] += 1;
    expect_waits(&stage, 1, "another camera");
    stage.view.width_px += 16;
    expect_waits(&stage, 2, "another size");
    stage.view.width_px += 16;
    stage.view.quality.shadow_resolution = 96;
    expect_waits(&stage, 2, "another size, of shadow maps, too");
    stage.view.width_px += 16;
    stage.view.quality.shadow_resolution = 128;
    stage.view.screen.channels = 0;
    stage.view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_DEPTH;
    const struct gl_counts counts = count_frame(&stage, &frame);
    assert_int_in_range(gl_counts_waits(&counts), 1, 2);
    frame_finish(&frame);
    stage_end(&stage);
}

/* The picture alone. */
static void a_moving_camera_waits_once(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage);
    expect_waits(&stage, 2, "the first frame");
    for (int i = 0; i < 4; i++) {
        stage.view.camera.eye[0] += 0.05;
        expect_waits(&stage, 1, "a step of the camera");
    }
    stage_end(&stage);
}

/* The numbers of shadow events come with the picture, too. */
static void moving_lamps_wait_once(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage);
    expect_waits(&stage, UINT64_MAX, "the first frame");
    for (int i = 0; i < 4; i++) {
        stage.lamps[0].position[0] += 0.05;
        stage.lamps[1].position[0] += 0.05;
        expect_waits(&stage, 1, "a step of the lamps");
    }
    stage_end(&stage);
}

/* Nothing stands, but how large lists are is known. */
static void a_picture_of_its_own_waits_once(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage);
    expect_waits(&stage, UINT64_MAX, "the first frame");
    for (int i = 0; i < 3; i++) {
        renderer_drop_structures(stage.renderer, stage.demo.key);
        expect_waits(&stage, 1, "a picture of its own");
    }
    stage_end(&stage);
}

static bool is_never_due(void *context)
{
    (void)context;
    return false;
}

static bool serve_nothing(void *context, struct error *err)
{
    (void)err;
    (void)context;
    return true;
}

/* A piece is waited for where the next one is with the device already, so that the device always
 * has one; no piece is where the device is done with it by then. */
static void shading_that_others_may_interrupt_stops_the_device_for_the_picture_alone(void **state)
{
    struct stage stage;
    const struct yield_point yield = {.should_yield = is_never_due, .run_urgent = serve_nothing};
    (void)state;
    stage_begin(&stage);
    stage.view.width_px = stage.view.height_px = 512; /* several pieces */
    expect_waits(&stage, UINT64_MAX, "the first frame");
    renderer_set_yield_point(stage.renderer, &yield);
    for (int i = 0; i < 3; i++) {
        struct frame frame;
        stage.view.camera.eye[0] += 0.05;
        const struct gl_counts counts = count_frame(&stage, &frame);
        frame_finish(&frame);
        assert_int_equal(gl_counts_waits(&counts), counts.waits[GL_WAIT_FENCE]);
        assert_int_equal(counts.stalls, 1);
    }
    stage_end(&stage);
}

/* The structures of a piece are sized by a read, of one light at least; that of the first brings
 * the numbers of layers, too. Later on sizes are known, and pieces are only waited for. */
static void a_first_picture_that_others_may_interrupt_reads_once_a_piece(void **state)
{
    struct stage stage;
    const struct yield_point yield = {.should_yield = is_never_due, .run_urgent = serve_nothing};
    (void)state;
    stage_begin(&stage);
    renderer_set_yield_point(stage.renderer, &yield);
    for (int i = 0; i < 2; i++) {
        struct frame frame;
        const struct gl_counts counts = count_frame(&stage, &frame);
        uint64_t reads = counts.waits[GL_WAIT_BUFFER_READ],
                 lights = frame.report.counts.shadowed_lights;
        assert_int_equal(lights, frame.report.counts.shadow_maps_built);
        assert_true(i ? reads == 0 : reads >= 1 && reads <= lights);
        assert_int_equal(gl_counts_waits(&counts), reads + counts.waits[GL_WAIT_FENCE]);
        frame_finish(&frame);
        renderer_drop_structures(stage.renderer, stage.demo.key);
    }
    stage_end(&stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_first_picture_of_a_scene_waits_twice),
        cmocka_unit_test(other_views_of_a_scene_wait_twice_at_most),
        cmocka_unit_test(a_moving_camera_waits_once),
        cmocka_unit_test(moving_lamps_wait_once),
        cmocka_unit_test(a_picture_of_its_own_waits_once),
        cmocka_unit_test(shading_that_others_may_interrupt_stops_the_device_for_the_picture_alone),
        cmocka_unit_test(a_first_picture_that_others_may_interrupt_reads_once_a_piece),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

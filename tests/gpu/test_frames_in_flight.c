/* SPDX-License-Identifier: MIT */
/* Frames in two halves: the picture of one comes while the next is made, with the bits and the
 * counts of frames that are made one after the other, whatever the next one is and does. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

enum { SHOTS = 12, WIDE_PX = 4200 /* more than a window's side */ };

/* One renderer, and what it made. Each has a GL context, so there is one at a time. */
struct stage {
    struct renderer *renderer;
    struct rig_scene demo;
    struct view views[SHOTS]; /* a frame in flight borrows its own */
    struct frame frames[SHOTS];
    int in_flight; /* index, or -1 */
    int collected_within, arrivals;
};

static const struct view_light shine = {.type = SCENE_LIGHT_DIRECTIONAL,
                                        .direction = {0.3, -1, 0.2},
                                        .color = {1, 0.5, 0.2},
                                        .intensity = 4};

/* A moving camera over glass, and what does not fly or waits in the middle: many windows, outputs,
 * edges, rays, shadows that are built, batches of lights. */
static struct view view_of(int shot)
{
    struct view view = {
        .width_px = 96 + 8 * shot,
        .height_px = 64,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}},
        .quality = {.shadow_resolution = 64, .samples = shot % 2 ? 1 : 4}};
    view.camera.eye[0] += 0.2 * shot;
    switch (shot) {
    case 2:
        view.width_px = WIDE_PX;
        view.height_px = 8;
        break;
    case 4:
        view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_DEPTH;
        break;
    case 5:
        view.edges.is_drawn = true;
        break;
    case 7:
        view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
        break;
    case 8:
        view.lights = &shine;
        view.light_count = 1;
        break;
    case 9:
        view.quality.shadows = SHADOWS_RAYTRACED;
        break;
    case 10:
        view.quality.light_lists = VIEW_LIGHT_LISTS_LINKED;
        break;
    default:
        break;
    }
    return view;
}

static bool may_be_in_flight(int shot)
{
    return shot != 5 && shot != 9;
}

static void stage_begin(struct stage *stage, bool defers)
{
    *stage = (struct stage){.in_flight = -1};
    stage->renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.defers_frames = defers});
    rig_demo_open(&stage->demo, stage->renderer, "demo", 64);
}

static void stage_end(struct stage *stage)
{
    for (int i = 0; i < SHOTS; i++)
        frame_finish(&stage->frames[i]);
    rig_scene_finish(&stage->demo, stage->renderer);
    renderer_destroy(stage->renderer);
}

static void collect(void *context)
{
    struct stage *stage = context;
    struct error err = {0};
    assert_true(stage->in_flight >= 0);
    stage->in_flight = -1;
    stage->arrivals++;
    if (!renderer_collect(stage->renderer, &err))
        fail_msg("%s", err.message);
}

/* Whether the frame took off. */
static bool submit(struct stage *stage, int shot)
{
    struct error err = {0};
    bool is_done;
    stage->views[shot] = view_of(shot);
    if (!renderer_submit(stage->renderer, stage->demo.key, &stage->views[shot],
                         &stage->frames[shot], &is_done, &err))
        fail_msg("frame %d: %s", shot, err.message);
    if (!is_done)
        stage->in_flight = shot;
    return !is_done;
}

/* Where each pass is fenced no two have the same time; on others they overlap the processor's work.
 */
static void expect_times(const struct frame_report *report, bool is_fenced)
{
    double sum = 0;
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        sum += report->stage_ms[i];
    if (is_fenced)
        assert_true(sum <= report->total_ms * 1.001);
    else
        assert_true(isnan(sum) || sum > 0);
}

static void expect_same(const struct stage *stage, int shot, const struct frame *alone)
{
    const struct frame *flown = &stage->frames[shot];
    const struct frame_report *a = &alone->report, *b = &flown->report;
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (alone->outputs[i].pixels)
            assert_same_bits(&alone->outputs[i], &flown->outputs[i]);
    if (memcmp(&a->counts, &b->counts, sizeof a->counts) != 0)
        fail_msg("frame %d has other counts", shot);
    assert_int_equal(a->pass_count, b->pass_count);
    for (int i = 0; i < a->pass_count; i++)
        assert_string_equal(a->passes[i].pass, b->passes[i].pass);
    struct renderer_info info;
    renderer_get_info(stage->renderer, &info);
    expect_times(b, info.is_software && !info.has_true_timers);
    assert_true(a->counts.lookups > 0 || shot == 7 || shot == 9);
}

static void shoot_alone(struct frame frames[SHOTS])
{
    struct stage stage;
    stage_begin(&stage, false);
    for (int i = 0; i < SHOTS; i++) {
        const struct view view = view_of(i);
        shoot(stage.renderer, &stage.demo, &view, &frames[i]);
    }
    rig_scene_finish(&stage.demo, stage.renderer);
    renderer_destroy(stage.renderer);
}

static struct frame alone[SHOTS];

static int alone_setup(void **state)
{
    (void)state;
    shoot_alone(alone);
    return 0;
}

static int alone_teardown(void **state)
{
    (void)state;
    for (int i = 0; i < SHOTS; i++)
        frame_finish(&alone[i]);
    return 0;
}

static void expect_all(const struct stage *stage)
{
    for (int i = 0; i < SHOTS; i++)
        expect_same(stage, i, &alone[i]);
}

static void frames_that_overlap_have_the_bits_of_frames_that_do_not(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, true);
    const struct frame_completion arrival = {.context = &stage, .collect = collect};
    renderer_set_completion(stage.renderer, &arrival);
    int flights = 0;
    for (int i = 0; i < SHOTS; i++) {
        bool is_in_flight = submit(&stage, i);
        assert_int_equal(may_be_in_flight(i), is_in_flight);
        flights += is_in_flight;
    }
    assert_int_equal(flights - 1, stage.arrivals); /* each by the frame after it, but the last */
    assert_false(renderer_wait(stage.renderer, 0));
    assert_true(renderer_wait(stage.renderer, 10000));
    collect(&stage);
    assert_true(renderer_wait(stage.renderer, 0));
    expect_all(&stage);
    stage_end(&stage);
}

/* The one in flight stays there, and all others end where they are submitted. */
static void without_an_arrival_one_frame_flies(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, true);
    assert_true(submit(&stage, 0));
    for (int i = 1; i < SHOTS; i++)
        assert_false(submit(&stage, i));
    assert_int_equal(0, stage.in_flight);
    collect(&stage);
    expect_all(&stage);
    stage_end(&stage);
}

static void a_frame_that_fails_leaves_the_one_in_flight(void **state)
{
    struct stage stage;
    struct frame failed;
    struct error err = {0};
    struct view bad = view_of(1);
    bool is_done;
    (void)state;
    stage_begin(&stage, true);
    assert_true(submit(&stage, 0));
    bad.quality.samples = 3;
    assert_false(renderer_submit(stage.renderer, stage.demo.key, &bad, &failed, &is_done, &err));
    assert_int_equal(ERROR_INVALID_REQUEST, err.code);
    assert_null(failed.outputs[VIEW_OUTPUT_COLOR].pixels);
    assert_int_equal(0, stage.in_flight);
    for (int i = 1; i < SHOTS; i++) /* as the frames before have what is kept */
        assert_false(submit(&stage, i));
    collect(&stage);
    expect_all(&stage);
    stage_end(&stage);
}

/* Before each frame, as where exposures are metered; with an arrival and without. */
static void metering_leaves_frames_in_flight_their_bits(void **state)
{
    (void)state;
    float first[2] = {0};
    for (int has_arrival = 0; has_arrival < 2; has_arrival++) {
        struct stage stage;
        stage_begin(&stage, true);
        const struct frame_completion arrival = {.context = &stage, .collect = collect};
        if (has_arrival)
            renderer_set_completion(stage.renderer, &arrival);
        for (int i = 0; i < 2; i++) {
            const struct view view = view_of(i);
            struct error err = {0};
            struct exposure_reading reading;
            assert_true(renderer_meter(stage.renderer, stage.demo.key, &view, &reading, &err));
            assert_false(reading.is_kept);
            if (has_arrival)
                assert_true(reading.ev == first[i]);
            first[i] = reading.ev;
            assert_int_equal(has_arrival || i == 0, submit(&stage, i));
        }
        collect(&stage);
        for (int i = 0; i < 2; i++)
            assert_same_bits(&alone[i].outputs[VIEW_OUTPUT_COLOR],
                             &stage.frames[i].outputs[VIEW_OUTPUT_COLOR]);
        stage_end(&stage);
    }
}

/* ---- within pauses ---- */

struct pauses {
    struct stage *stage;
    int left;
    uint64_t hash; /* of the frame that is made in each */
};

static bool is_due(void *context)
{
    const struct pauses *pauses = context;
    return pauses->left > 0;
}

static bool serve(void *context, struct error *why)
{
    (void)why;
    struct pauses *pauses = context;
    struct stage *stage = pauses->stage;
    const struct view view = view_of(3);
    struct error err = {0};
    struct frame frame;
    bool is_done;
    assert_int_equal(-1, stage->in_flight); /* who is in flight does not wait for a pause */
    assert_true(renderer_submit(stage->renderer, stage->demo.key, &view, &frame, &is_done, &err));
    assert_true(is_done);
    assert_int_equal(pauses->hash, image_hash(&frame.outputs[VIEW_OUTPUT_COLOR]));
    frame_finish(&frame);
    pauses->left--;
    return true;
}

static void pauses_and_flights_go_together(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, true);
    const struct frame_completion arrival = {.context = &stage, .collect = collect};
    renderer_set_completion(stage.renderer, &arrival);
    assert_true(submit(&stage, 1));
    struct pauses pauses = {&stage, 8, image_hash(&alone[3].outputs[VIEW_OUTPUT_COLOR])};
    const struct yield_point yield = {
        .context = &pauses, .should_yield = is_due, .run_urgent = serve};
    renderer_set_yield_point(stage.renderer, &yield);
    assert_true(submit(&stage, 2)); /* of two windows, one of which is sent when the other pauses */
    renderer_set_yield_point(stage.renderer, NULL);
    assert_int_equal(0, pauses.left);
    collect(&stage);
    for (int i = 1; i < 3; i++)
        assert_same_bits(&alone[i].outputs[VIEW_OUTPUT_COLOR],
                         &stage.frames[i].outputs[VIEW_OUTPUT_COLOR]);
    assert_int_equal(alone[2].report.counts.lookups, stage.frames[2].report.counts.lookups);
    stage_end(&stage);
}

static void a_frame_that_has_come_is_done_at_once(void **state)
{
    struct stage stage;
    struct renderer_info info;
    (void)state;
    stage_begin(&stage, false);
    renderer_get_info(stage.renderer, &info);
    for (int i = 0; i < 2; i++) {
        bool is_in_flight = submit(&stage, i);
        /* Passes are waited for, so nothing is left to wait for. */
        if (info.is_software && !info.has_true_timers)
            assert_false(is_in_flight);
        if (is_in_flight)
            collect(&stage);
        expect_same(&stage, i, &alone[i]);
    }
    stage_end(&stage);
}

/* Two frames after each other, the second one beside the first or not. */
static uint64_t resident_after_two(bool has_arrival)
{
    struct stage stage;
    stage_begin(&stage, true);
    const struct frame_completion arrival = {.context = &stage, .collect = collect};
    if (has_arrival)
        renderer_set_completion(stage.renderer, &arrival);
    assert_true(submit(&stage, 1));
    assert_int_equal(has_arrival, submit(&stage, 3));
    collect(&stage);
    for (int i = 1; i < 4; i += 2) {
        int pixels = stage.frames[i].outputs[VIEW_OUTPUT_COLOR].width_px * 64;
        assert_int_equal(pixels * 16 + 260, report_bytes_of(&stage.frames[i].report, "readback"));
    }
    uint64_t bytes = stage.frames[3].report.resident_bytes;
    stage_end(&stage);
    return bytes;
}

static void both_buffers_count_against_the_budget(void **state)
{
    (void)state;
    assert_true(resident_after_two(false) > resident_after_two(true));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_that_overlap_have_the_bits_of_frames_that_do_not),
        cmocka_unit_test(without_an_arrival_one_frame_flies),
        cmocka_unit_test(a_frame_that_fails_leaves_the_one_in_flight),
        cmocka_unit_test(metering_leaves_frames_in_flight_their_bits),
        cmocka_unit_test(pauses_and_flights_go_together),
        cmocka_unit_test(a_frame_that_has_come_is_done_at_once),
        cmocka_unit_test(both_buffers_count_against_the_budget),
    };
    return cmocka_run_group_tests(tests, alone_setup, alone_teardown);
}

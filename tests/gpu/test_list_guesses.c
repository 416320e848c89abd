/* SPDX-License-Identifier: MIT */
/* Per-pixel lists whose sizes are guessed from the frame before: the device is not asked for them,
 * and every picture has the bits of one whose sizes were read, however wrong the guess was. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/gl_hooks.h"
#include "tests/support/image_checks.h"

enum { PANES = 60, SHOTS = 10, WIDE_PX = 4200 /* more than a window's side */ };

/* ---- what reads ---- */

static PFNGLGETNAMEDBUFFERSUBDATAPROC read_below;
static int reads;

static void GLAPIENTRY count_read(GLuint buffer, GLintptr offset, GLsizeiptr size, void *data)
{
    reads++;
    read_below(buffer, offset, size, data);
}

/* ---- a stage ---- */

struct stage {
    struct renderer *renderer;
    struct rig_scene panes;
    struct view views[SHOTS]; /* a frame in flight borrows its own */
    struct frame frames[SHOTS];
    int in_flight, order[SHOTS], arrived; /* index, or -1; in which they came */
};

static void open_panes(struct stage *stage)
{
    double colors[PANES][4];
    struct closed_form_scene scene;
    for (int i = 0; i < PANES; i++)
        for (int c = 0; c < 4; c++)
            colors[i][c] = c < 3 ? 0.9 + 0.1 * ((i * 7 + c) % 11) / 11 : 1;
    panes_scene_build(
        &(struct panes_scene_desc){.pane_count = PANES, .colors = (const double(*)[4])colors},
        &scene);
    rig_scene_open(&stage->panes, stage->renderer, "panes", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

static void stage_begin(struct stage *stage, const struct renderer_desc *desc)
{
    struct renderer_desc strict = *desc;
    *stage = (struct stage){.in_flight = -1};
    strict.is_strict = true;
    stage->renderer = render_rig_create_as(&strict);
    open_panes(stage);
    if (!read_below)
        GL_SPY_BEGIN(GetNamedBufferSubData, read_below, count_read);
}

static void stage_end(struct stage *stage)
{
    for (int i = 0; i < SHOTS; i++)
        frame_finish(&stage->frames[i]);
    rig_scene_finish(&stage->panes, stage->renderer);
    renderer_destroy(stage->renderer);
}

/* From beside the panes, from far above them, into them, away from them and back: few short lists,
 * few long ones, many long ones, none. */
static struct view view_of(int shot)
{
    static const double eyes[SHOTS][3] = {
        {9, 4, 0.1},   {9.1, 4, 0.1}, {0, 60, 0.1}, {0.1, 60, 0.1}, {0, 8.5, 0.1},
        {0, 8.4, 0.1}, {0, 70, 0.1},  {0, 65, 0.1}, {0, 60, 0.1},   {0.1, 8.5, 0}};
    struct view view = {.width_px = 48,
                        .height_px = 32,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 4, 0}},
                        .quality = {.shadows = SHADOWS_NONE, .samples = 1}};
    memcpy(view.camera.eye, eyes[shot], sizeof view.camera.eye);
    if (shot == 6) /* up, where nothing is */
        view.camera.target[1] = 100;
    return view;
}

static void expect_same(int shot, const struct frame *read, const struct frame *guessed)
{
    const struct frame_report *a = &read->report, *b = &guessed->report;
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (read->outputs[i].pixels)
            assert_same_bits(&read->outputs[i], &guessed->outputs[i]);
    if (a->counts.transparent_fragments != b->counts.transparent_fragments ||
        a->counts.longest_pixel_list != b->counts.longest_pixel_list)
        fail_msg("shot %d: %llu entries, longest %llu; read: %llu, %llu", shot,
                 (unsigned long long)b->counts.transparent_fragments,
                 (unsigned long long)b->counts.longest_pixel_list,
                 (unsigned long long)a->counts.transparent_fragments,
                 (unsigned long long)a->counts.longest_pixel_list);
}

/* By a renderer that reads. */
static void shoot_all(const struct renderer_desc *desc, struct view (*of)(int shot),
                      struct frame frames[SHOTS])
{
    struct stage stage;
    stage_begin(&stage, desc);
    for (int i = 0; i < SHOTS; i++) {
        const struct view view = of(i);
        shoot(stage.renderer, &stage.panes, &view, &frames[i]);
    }
    stage_end(&stage);
}

static void finish_all(struct frame frames[SHOTS])
{
    for (int i = 0; i < SHOTS; i++)
        frame_finish(&frames[i]);
}

static struct frame plain[SHOTS];

static int plain_setup(void **state)
{
    (void)state;
    shoot_all(&(struct renderer_desc){.device = 0}, view_of, plain);
    assert_int_equal(0, plain[6].report.counts.transparent_fragments);
    assert_true(plain[0].report.counts.transparent_fragments > 0);
    assert_true(plain[4].report.counts.transparent_fragments >
                10 * plain[3].report.counts.transparent_fragments);
    assert_int_equal(PANES, plain[4].report.counts.longest_pixel_list);
    return 0;
}

static int plain_teardown(void **state)
{
    (void)state;
    finish_all(plain);
    return 0;
}

/* ---- one frame after the other ---- */

static void guesses_of_any_quality_give_the_same_bits(void **state)
{
    /* read where nothing is known, and where lists did not find room */
    static const int expected_reads[SHOTS] = {1, 0, 1, 0, 1, 0, 0, 0, 0, 0};
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.hooks.poses_as_hardware = true});
    for (int i = 0; i < SHOTS; i++) {
        const struct view view = view_of(i);
        int before = reads;
        shoot(stage.renderer, &stage.panes, &view, &stage.frames[i]);
        if (reads - before != expected_reads[i])
            fail_msg("shot %d: %d reads", i, reads - before);
        expect_same(i, &plain[i], &stage.frames[i]);
        assert_false(stage.frames[i].report.has_cut_lists);
    }
    stage_end(&stage);
}

/* Light alone changes, so lists stand, whose sizes no frame has asked for. */
static void kept_lists_are_still_checked(void **state)
{
    struct stage stage;
    struct frame again;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.hooks.poses_as_hardware = true});
    for (int i = 2; i < 6; i++) {
        struct view view = view_of(i);
        shoot(stage.renderer, &stage.panes, &view, &stage.frames[i]);
        int before = reads;
        shoot(stage.renderer, &stage.panes, &view, &again);
        assert_int_equal(before, reads);
        assert_int_equal(1, again.report.counts.pixel_lists_reused);
        expect_same(i, &plain[i], &again);
        frame_finish(&again);
        view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_LAYERS; /* which reads them */
        shoot(stage.renderer, &stage.panes, &view, &again);
        assert_same_bits(&plain[i].outputs[VIEW_OUTPUT_COLOR], &again.outputs[VIEW_OUTPUT_COLOR]);
        assert_int_equal(plain[i].report.counts.longest_pixel_list,
                         again.report.counts.longest_pixel_list);
        frame_finish(&again);
    }
    stage_end(&stage);
}

static struct view wide_view(int shot)
{
    struct view view = view_of(shot);
    view.width_px = WIDE_PX;
    view.height_px = 8;
    view.camera.fov_y_deg = 2;
    return view;
}

static void expect_same_sequence(const struct renderer_desc *desc, struct view (*of)(int shot))
{
    struct frame read[SHOTS], guessed[SHOTS];
    struct renderer_desc posing = *desc;
    posing.hooks.poses_as_hardware = true;
    shoot_all(desc, of, read);
    shoot_all(&posing, of, guessed);
    for (int i = 0; i < SHOTS; i++)
        expect_same(i, &read[i], &guessed[i]);
    finish_all(read);
    finish_all(guessed);
}

static void every_window_has_its_guess(void **state)
{
    (void)state;
    expect_same_sequence(&(struct renderer_desc){.device = 0}, wide_view);
}

static struct view tall_view(int shot)
{
    struct view view = view_of(shot);
    view.width_px = view.height_px = 96;
    view.quality.samples = shot % 2 ? 1 : 4;
    return view;
}

/* Where there is no room for a guess, what is there decides. */
static void budgets_hold_with_guesses(void **state)
{
    (void)state;
    for (uint64_t budget = 24ull << 20; budget <= 96ull << 20; budget *= 2)
        expect_same_sequence(&(struct renderer_desc){.gpu_budget_bytes = budget}, tall_view);
}

/* ---- frames in flight ---- */

static void collect(void *context)
{
    struct stage *stage = context;
    struct error err = {0};
    assert_true(stage->in_flight >= 0);
    stage->order[stage->arrived++] = stage->in_flight;
    stage->in_flight = -1;
    if (!renderer_collect(stage->renderer, &err))
        fail_msg("%s", err.message);
}

static bool submit(struct stage *stage, int shot)
{
    struct error err = {0};
    bool is_done;
    stage->views[shot] = view_of(shot);
    if (!renderer_submit(stage->renderer, stage->panes.key, &stage->views[shot],
                         &stage->frames[shot], &is_done, &err))
        fail_msg("frame %d: %s", shot, err.message);
    if (is_done)
        stage->order[stage->arrived++] = shot;
    else
        stage->in_flight = shot;
    return !is_done;
}

static void frames_in_flight_are_made_again_before_they_arrive(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.hooks.poses_as_hardware = true,
                                                .hooks.defers_frames = true});
    const struct frame_completion arrival = {.context = &stage, .collect = collect};
    renderer_set_completion(stage.renderer, &arrival);
    for (int i = 0; i < SHOTS; i++)
        submit(&stage, i);
    if (stage.in_flight >= 0)
        collect(&stage);
    assert_int_equal(SHOTS, stage.arrived);
    for (int i = 0; i < SHOTS; i++) {
        assert_int_equal(i, stage.order[i]);
        expect_same(i, &plain[i], &stage.frames[i]);
    }
    stage_end(&stage);
}

static void without_an_arrival_a_cut_frame_is_made_again_when_it_is_collected(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.hooks.poses_as_hardware = true,
                                                .hooks.defers_frames = true});
    for (int i = 3; i < SHOTS; i++) {
        assert_true(submit(&stage, i));
        collect(&stage);
        expect_same(i, &plain[i], &stage.frames[i]);
    }
    stage_end(&stage);
}

/* ---- within pauses ---- */

struct pauses {
    struct stage *stage;
    int left; /* shots that go before the rest of another */
    bool is_early;
};

static bool is_due(void *context)
{
    const struct pauses *pauses = context;
    return pauses->left > 0;
}

static bool serve(void *context, struct error *err)
{
    (void)err;
    struct pauses *pauses = context;
    struct stage *stage = pauses->stage;
    struct frame frame;
    pauses->is_early |= stage->arrived > 0;
    if (!pauses->left)
        return true;
    int shot = SHOTS - pauses->left--;
    const struct view view = view_of(shot);
    shoot(stage->renderer, &stage->panes, &view, &frame);
    expect_same(shot, &plain[shot], &frame);
    frame_finish(&frame);
    return true;
}

/* The one that is paused, and those that go before it, each have lists of their own. */
static void urgent_frames_have_guesses_of_their_own(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage,
                &(struct renderer_desc){.hooks.poses_as_hardware = true, .hooks.first_slice = 64});
    for (int i = 2; i < 6; i++) {
        struct pauses pauses = {.stage = &stage, .left = 4};
        const struct yield_point yield = {
            .context = &pauses, .should_yield = is_due, .run_urgent = serve};
        const struct view view = view_of(i);
        renderer_set_yield_point(stage.renderer, &yield);
        shoot(stage.renderer, &stage.panes, &view, &stage.frames[i]);
        renderer_set_yield_point(stage.renderer, NULL);
        assert_int_equal(0, pauses.left);
        expect_same(i, &plain[i], &stage.frames[i]);
    }
    stage_end(&stage);
}

/* A frame that was cut does not wait for the end of one that stops for others. */
static void a_cut_frame_goes_before_the_rest_of_a_long_one(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.hooks.poses_as_hardware = true,
                                                .hooks.defers_frames = true,
                                                .hooks.first_slice = 64});
    const struct frame_completion arrival = {.context = &stage, .collect = collect};
    renderer_set_completion(stage.renderer, &arrival);
    struct pauses pauses = {.stage = &stage};
    const struct yield_point yield = {
        .context = &pauses, .should_yield = is_due, .run_urgent = serve};
    assert_true(submit(&stage, 3));
    collect(&stage);
    assert_true(submit(&stage, 4));
    stage.arrived = 0;
    renderer_set_yield_point(stage.renderer, &yield);
    submit(&stage, 5);
    renderer_set_yield_point(stage.renderer, NULL);
    assert_true(pauses.is_early);
    if (stage.in_flight >= 0)
        collect(&stage);
    assert_int_equal(4, stage.order[0]);
    for (int i = 3; i < 6; i++)
        expect_same(i, &plain[i], &stage.frames[i]);
    stage_end(&stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(guesses_of_any_quality_give_the_same_bits),
        cmocka_unit_test(kept_lists_are_still_checked),
        cmocka_unit_test(every_window_has_its_guess),
        cmocka_unit_test(budgets_hold_with_guesses),
        cmocka_unit_test(frames_in_flight_are_made_again_before_they_arrive),
        cmocka_unit_test(without_an_arrival_a_cut_frame_is_made_again_when_it_is_collected),
        cmocka_unit_test(urgent_frames_have_guesses_of_their_own),
        cmocka_unit_test(a_cut_frame_goes_before_the_rest_of_a_long_one),
    };
    return cmocka_run_group_tests(tests, plain_setup, plain_teardown);
}

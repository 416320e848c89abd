/* SPDX-License-Identifier: MIT */
/* Lists of shadow events whose sizes are guessed from those of the light before: the device is not
 * asked for them, and every picture has the bits of one whose sizes were read, however wrong the
 * guess was. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/frame/renderer_internal.h"
#include "renderer/shadows/shadows_internal.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/gl_counts.h"
#include "tests/support/image_checks.h"

enum { PANES = 40, SHOTS = 12, LAMPS = 3 };

struct stage {
    struct renderer *renderer;
    struct rig_scene panes;
    struct view views[SHOTS]; /* a frame in flight borrows its own */
    struct view_light lamps[SHOTS][LAMPS];
    struct frame frames[SHOTS];
    int in_flight, order[SHOTS], arrived; /* index, or -1; in which they came */
};

static void stage_begin(struct stage *stage, const struct renderer_desc *desc)
{
    struct renderer_desc strict = *desc;
    double colors[PANES][4];
    struct closed_form_scene scene;
    *stage = (struct stage){.in_flight = -1};
    strict.is_strict = strict.hooks.poses_as_hardware = true;
    strict.hooks.wide_floats = WIDE_FLOATS_F64; /* else as is quicker at the start */
    stage->renderer = render_rig_create_as(&strict);
    for (int i = 0; i < PANES; i++)
        for (int c = 0; c < 4; c++)
            colors[i][c] = c < 3 ? 0.9 + 0.1 * ((i * 7 + c) % 11) / 11 : 1;
    panes_scene_build(
        &(struct panes_scene_desc){.pane_count = PANES, .colors = (const double(*)[4])colors},
        &scene);
    rig_scene_open(&stage->panes, stage->renderer, "panes", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

static void stage_end(struct stage *stage)
{
    for (int i = 0; i < SHOTS; i++)
        frame_finish(&stage->frames[i]);
    rig_scene_finish(&stage->panes, stage->renderer);
    renderer_destroy(stage->renderer);
}

/* Lamps far above the panes, where few texels have long lists, just above them, where most have,
 * between them, beside them and turned away; one step or leap after the other. Some are not there
 * in every shot. */
static const struct view *view_of(struct stage *stage, int shot)
{
    static const double heights[SHOTS] = {60, 59.9, 59.8, 9, 8.9, 60, 4, 4.1, 70, 8.5, 8.4, 60};
    static const int counts[SHOTS] = {2, 2, 2, 2, 3, 1, 3, 3, 3, 0, 2, 3};
    for (int i = 0; i < LAMPS; i++)
        stage->lamps[shot][i] =
            (struct view_light){.type = SCENE_LIGHT_SPOT,
                                .position = {0.3 * i - 0.2, heights[(shot + i) % SHOTS], 0.1 * i},
                                .direction = {0.01, shot == 8 ? 1 : -1, 0.02},
                                .color = {1, 1, 1},
                                .intensity = 3000};
    stage->views[shot] = (struct view){
        .width_px = 40,
        .height_px = 24,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {9, 5, 0.1}, .target = {0, 2, 0}},
        .lights = stage->lamps[shot],
        .light_count = (size_t)counts[shot],
        .quality = {.shadows = SHADOWS_DEEP, .shadow_resolution = 64}};
    return &stage->views[shot];
}

static void take(struct stage *stage, int shot)
{
    shoot(stage->renderer, &stage->panes, view_of(stage, shot), &stage->frames[shot]);
}

static struct frame plain[SHOTS]; /* by a renderer that reads */

static void expect_same(int shot, const struct frame *frame)
{
    const struct frame_report *a = &plain[shot].report, *b = &frame->report;
    uint64_t bytes[2] = {0, 0};
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (plain[shot].outputs[i].pixels)
            assert_same_bits(&plain[shot].outputs[i], &frame->outputs[i]);
    for (int which = 0; which < 2; which++)
        for (int i = 0; i < (which ? b : a)->byte_count; i++)
            if (strcmp((which ? b : a)->bytes[i].structure, "shadow.deep.events") == 0)
                bytes[which] = (which ? b : a)->bytes[i].bytes;
    if (a->counts.events != b->counts.events || a->counts.longest_list != b->counts.longest_list ||
        a->counts.mean_list != b->counts.mean_list || bytes[0] != bytes[1])
        fail_msg("shot %d: %llu events, longest %llu, mean %g, %llu bytes; read: %llu, %llu, %g, "
                 "%llu",
                 shot, (unsigned long long)b->counts.events,
                 (unsigned long long)b->counts.longest_list, b->counts.mean_list,
                 (unsigned long long)bytes[1], (unsigned long long)a->counts.events,
                 (unsigned long long)a->counts.longest_list, a->counts.mean_list,
                 (unsigned long long)bytes[0]);
    assert_false(b->has_cut_lists);
}

/* By a renderer that reads, or one that guesses. */
static void take_all(const struct renderer_desc *desc, bool reads, struct frame frames[SHOTS])
{
    struct stage stage;
    stage_begin(&stage, desc);
    stage.renderer->frames.reads_sizes = reads;
    for (int i = 0; i < SHOTS; i++) {
        take(&stage, i);
        frames[i] = stage.frames[i];
        stage.frames[i] = (struct frame){0};
    }
    stage_end(&stage);
}

static void finish_all(struct frame frames[SHOTS])
{
    for (int i = 0; i < SHOTS; i++)
        frame_finish(&frames[i]);
}

static int plain_setup(void **state)
{
    (void)state;
    take_all(&(struct renderer_desc){.device = 0}, true, plain);
    uint64_t alone = plain[9].report.counts.events; /* of the scene's own light */
    assert_true(plain[6].report.counts.events > 10 * plain[0].report.counts.events);
    assert_true(plain[0].report.counts.events > alone);
    assert_int_equal(alone, plain[8].report.counts.events);
    assert_int_equal(PANES, plain[6].report.counts.longest_list);
    return 0;
}

static int plain_teardown(void **state)
{
    (void)state;
    finish_all(plain);
    return 0;
}

/* ---- one frame after the other ---- */

static size_t count_guesses(const struct stage *stage, enum shadow_guess_state state)
{
    const struct shadow_guesses *guesses = &stage->renderer->shadows->guesses;
    size_t count = 0;
    for (uint64_t i = guesses->oldest; i < guesses->next; i++)
        count += shadow_guesses_find(guesses, i)->state == state;
    return count;
}

static void guesses_of_any_quality_give_the_same_bits(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.device = 0});
    for (int i = 0; i < SHOTS; i++) {
        take(&stage, i);
        expect_same(i, &stage.frames[i]);
    }
    assert_true(count_guesses(&stage, SHADOW_GUESS_FITS) > 3);
    assert_true(count_guesses(&stage, SHADOW_GUESS_CUT) > 1);
    assert_int_equal(0, count_guesses(&stage, SHADOW_GUESS_OPEN));
    stage_end(&stage);
}

/* What the history says of every light. */
static void set_history(struct stage *stage, const struct deep_statistics *seen)
{
    struct shadow_history *history = &stage->renderer->shadows->guesses.history;
    for (size_t i = 0; i < history->capacity; i++)
        history->slots[i].seen = *seen;
}

static void wrong_histories_give_the_same_bits(void **state)
{
    static const struct deep_statistics wrong[] = {
        {.total = 0},
        {.total = 1, .longest = 1, .occupied = 1},
        {.total = 1u << 20, .longest = 1},
        {.total = 1u << 20, .longest = 3000},                      /* no lists to sort */
        {.total = 1, .longest = 3000, .classes = {9, 9, 9, 9, 9}}, /* no room for events */
        {.total = 1u << 20, .longest = 40, .classes = {1u << 12}}, /* of another class */
        {.total = 1u << 30, .longest = 59000, .classes = {1u << 20}},
        {.total = UINT32_MAX, .total_high = UINT32_MAX, .longest = UINT32_MAX},
    };
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.device = 0});
    take(&stage, 0);
    for (size_t w = 0; w < sizeof wrong / sizeof wrong[0]; w++)
        for (int i = 2; i < 5; i++) {
            set_history(&stage, &wrong[w]);
            frame_finish(&stage.frames[i]);
            take(&stage, i);
            expect_same(i, &stage.frames[i]);
            renderer_drop_structures(stage.renderer, stage.panes.key);
        }
    stage_end(&stage);
}

/* What has no room is read. */
static void budgets_hold_with_guesses(void **state)
{
    (void)state;
    for (uint64_t budget = 8ull << 20; budget <= 32ull << 20; budget *= 2) {
        const struct renderer_desc desc = {.gpu_budget_bytes = budget};
        struct frame read[SHOTS], guessed[SHOTS];
        take_all(&desc, true, read);
        take_all(&desc, false, guessed);
        for (int i = 0; i < SHOTS; i++) {
            assert_same_bits(&read[i].outputs[VIEW_OUTPUT_COLOR],
                             &guessed[i].outputs[VIEW_OUTPUT_COLOR]);
            assert_int_equal(read[i].report.counts.events, guessed[i].report.counts.events);
        }
        finish_all(read);
        finish_all(guessed);
    }
}

/* Pictures that are read on their way have no guesses, and what was guessed before is read then. */
static void maps_whose_sizes_have_not_come_are_read_where_no_picture_brings_them(void **state)
{
    struct stage stage;
    struct frame frame;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.device = 0});
    for (int i = 0; i < 3; i++)
        take(&stage, i);
    for (int i = 3; i < 6; i++) {
        struct error err = {0};
        struct view view = *view_of(&stage, i);
        if (!renderer_build(stage.renderer, stage.panes.key, &view, &frame, &err))
            fail_msg("%s", err.message);
        frame_finish(&frame);
        view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_DEPTH;
        shoot(stage.renderer, &stage.panes, &view, &frame);
        assert_same_bits(&plain[i].outputs[VIEW_OUTPUT_COLOR], &frame.outputs[VIEW_OUTPUT_COLOR]);
        frame_finish(&frame);
    }
    stage_end(&stage);
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

static void submit(struct stage *stage, int shot, const struct view *view)
{
    struct error err = {0};
    bool is_done;
    if (!renderer_submit(stage->renderer, stage->panes.key, view, &stage->frames[shot], &is_done,
                         &err))
        fail_msg("frame %d: %s", shot, err.message);
    if (is_done)
        stage->order[stage->arrived++] = shot;
    else
        stage->in_flight = shot;
}

static void frames_in_flight_are_made_again_before_they_arrive(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.hooks.defers_frames = true});
    const struct frame_completion arrival = {.context = &stage, .collect = collect};
    renderer_set_completion(stage.renderer, &arrival);
    for (int i = 0; i < SHOTS; i++)
        submit(&stage, i, view_of(&stage, i));
    if (stage.in_flight >= 0)
        collect(&stage);
    assert_int_equal(SHOTS, stage.arrived);
    for (int i = 0; i < SHOTS; i++) {
        assert_int_equal(i, stage.order[i]);
        expect_same(i, &stage.frames[i]);
    }
    stage_end(&stage);
}

/* The next frame takes the maps of the one in flight, of which nobody knows whether they are right.
 */
static void maps_of_a_frame_in_flight_are_checked_for_those_that_share_them(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.hooks.defers_frames = true});
    const struct frame_completion arrival = {.context = &stage, .collect = collect};
    renderer_set_completion(stage.renderer, &arrival);
    submit(&stage, 0, view_of(&stage, 0));
    for (int i = 3; i < 7; i++) { /* leaps; each picture twice */
        const struct view *view = view_of(&stage, i);
        submit(&stage, i, view);
        submit(&stage, i + 5, view);
        if (stage.in_flight >= 0)
            collect(&stage);
        expect_same(i, &stage.frames[i]);
        expect_same(i, &stage.frames[i + 5]);
        frame_finish(&stage.frames[i]);
        frame_finish(&stage.frames[i + 5]);
        stage.arrived = 0;
    }
    stage_end(&stage);
}

/* ---- within pauses ---- */

struct pauses {
    struct stage *stage;
    int left; /* shots that go before the rest of another */
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
    if (!pauses->left)
        return true;
    int shot = SHOTS - pauses->left--;
    shoot(stage->renderer, &stage->panes, view_of(stage, shot), &frame);
    expect_same(shot, &frame);
    frame_finish(&frame);
    return true;
}

/* The one that is paused, and those that go before it, each know their own lists. */
static void urgent_frames_have_guesses_of_their_own(void **state)
{
    struct stage stage;
    (void)state;
    stage_begin(&stage, &(struct renderer_desc){.hooks.first_slice = 64});
    for (int i = 2; i < 7; i++) {
        struct pauses pauses = {.stage = &stage, .left = 5};
        const struct yield_point yield = {
            .context = &pauses, .should_yield = is_due, .run_urgent = serve};
        renderer_set_yield_point(stage.renderer, &yield);
        take(&stage, i);
        renderer_set_yield_point(stage.renderer, NULL);
        assert_int_equal(0, pauses.left);
        expect_same(i, &stage.frames[i]);
    }
    stage_end(&stage);
}

/* ---- what it is for ---- */

/* Nothing is waited for but the picture: the first time, and where a lamp leaps, the device is
 * asked. */
static void steps_wait_for_nothing_but_the_picture(void **state)
{
    static const uint64_t least[] = {2, 1, 3}, most[] = {2, 1, 4}; /* both kinds of lists are read
                                                                      at once, and the picture */
    struct stage stage;
    (void)state;
    gl_hooks_install(&(struct gl_hooks_desc){
        .counts = true, .hostility = {.is_not_software = true, .timers = GL_TIMERS_TRUE}});
    stage_begin(&stage, &(struct renderer_desc){.hooks.defers_frames = true});
    for (int i = 0; i < 3; i++) {
        struct gl_counts before, after;
        gl_counts_get(&before);
        take(&stage, i);
        gl_counts_get(&after);
        const struct gl_counts counts = gl_counts_between(&before, &after);
        assert_in_range(gl_counts_waits(&counts), least[i], most[i]);
    }
    stage_end(&stage);
    gl_hooks_install(&(struct gl_hooks_desc){.counts = false});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(guesses_of_any_quality_give_the_same_bits),
        cmocka_unit_test(wrong_histories_give_the_same_bits),
        cmocka_unit_test(budgets_hold_with_guesses),
        cmocka_unit_test(maps_whose_sizes_have_not_come_are_read_where_no_picture_brings_them),
        cmocka_unit_test(frames_in_flight_are_made_again_before_they_arrive),
        cmocka_unit_test(maps_of_a_frame_in_flight_are_checked_for_those_that_share_them),
        cmocka_unit_test(urgent_frames_have_guesses_of_their_own),
        cmocka_unit_test(steps_wait_for_nothing_but_the_picture),
    };
    return cmocka_run_group_tests(tests, plain_setup, plain_teardown);
}

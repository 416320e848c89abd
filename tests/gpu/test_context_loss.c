/* SPDX-License-Identifier: MIT */
/* A context that is lost after the n-th call of GL, for many n: while a renderer is created, in
 * frames of every technique, between the halves of a frame. Each time the error says so, nothing
 * crashes or hangs, and the next renderer's pictures have the bits that they had. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>

#include "tests/support/gl_hooks.h"
#include "tests/support/gl_hostile.h"
#include "tests/support/image_checks.h"

enum {
    FIRST = 8,     /* losses after each of the first calls ... */
    SPREAD = 16,   /* ... and so many over the rest */
    ALARM_S = 600, /* nothing may hang */
    WIDTH_PX = 64,
    HEIGHT_PX = 48,
};

static const struct {
    const char *name;
    struct view view;
} shots[] = {
    {"deep", {.quality = {.shadow_resolution = 32, .samples = 4}}},
    {"deep-linked", {.quality = {.shadow_resolution = 32, .shadows = SHADOWS_DEEP_LINKED}}},
    {"raytraced-shadows", {.quality = {.shadows = SHADOWS_RAYTRACED_SHADOWS}}},
    {"outputs",
     {.quality = {.shadow_resolution = 32, .light_lists = VIEW_LIGHT_LISTS_LINKED},
      .outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_DEPTH | 1u << VIEW_OUTPUT_NORMAL}},
};
enum { SHOTS = sizeof shots / sizeof *shots };

static struct view view_of(int shot)
{
    struct view view = shots[shot].view;
    view.width_px = WIDTH_PX;
    view.height_px = HEIGHT_PX;
    view.camera = (struct view_camera){
        .kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}};
    return view;
}

/* The n-th of the losses that are tried among so many calls. */
static uint64_t loss(int n, uint64_t calls)
{
    return n < FIRST ? (uint64_t)n + 1
                     : FIRST + 1 + (uint64_t)(n - FIRST) * (calls - FIRST) / SPREAD;
}

struct stage {
    struct renderer *renderer;
    struct rig_scene demo;
};

static void open_stage(struct stage *stage)
{
    gl_hostile_lose_after(0);
    stage->renderer = render_rig_create();
    rig_demo_open_fine(&stage->demo, stage->renderer, "demo", 64);
}

static void close_stage(struct stage *stage)
{
    rig_scene_finish(&stage->demo, stage->renderer);
    renderer_destroy(stage->renderer);
}

static bool never_stop(void *context)
{
    (void)context;
    return false;
}

enum { ATTACH = SHOTS, WARM_UP, TRIALS };

/* Whether it succeeded; then with these bits, of a shot. */
static bool try_it(struct stage *stage, int trial, uint64_t *hash, struct error *err)
{
    const struct view view = view_of(trial < SHOTS ? trial : 0);
    struct frame frame = {0};
    bool is_complete;
    *hash = 0;
    if (trial == ATTACH)
        return renderer_attach_scene(
            stage->renderer,
            &(struct renderer_scene_desc){.key = "again", .scene = &stage->demo.imported.scene},
            err);
    if (trial == WARM_UP)
        return renderer_warm_up(stage->renderer, stage->demo.key, &view,
                                &(struct renderer_warm_up_desc){.shall_stop = never_stop},
                                &is_complete, err);
    bool ok = renderer_render(stage->renderer, stage->demo.key, &view, &frame, err);
    if (ok)
        *hash = image_hash(&frame.outputs[VIEW_OUTPUT_COLOR]);
    frame_finish(&frame);
    return ok;
}

static const char *name_of(int trial)
{
    return trial == ATTACH ? "attach" : trial == WARM_UP ? "warm up" : shots[trial].name;
}

static void lose_in(int trial, uint64_t after, uint64_t expected)
{
    struct stage stage;
    struct error err = {0};
    uint64_t hash;
    open_stage(&stage);
    gl_hostile_lose_after(after);
    bool ok = try_it(&stage, trial, &hash, &err);
    bool is_lost = gl_hostile_is_lost();
    close_stage(&stage);
    gl_hostile_lose_after(0);
    if (!ok && err.code != ERROR_NO_DEVICE)
        fail_msg("%s, lost after %llu calls: %d, %s", name_of(trial), (unsigned long long)after,
                 (int)err.code, err.message);
    if (ok && hash != expected)
        fail_msg("%s, lost after %llu calls: another picture", name_of(trial),
                 (unsigned long long)after);
    assert_true(is_lost || ok);
}

static void what_loses_its_context_fails_for_lack_of_a_device(void **state)
{
    (void)state;
    for (int trial = 0; trial < TRIALS; trial++) {
        struct stage stage;
        struct error err = {0};
        uint64_t expected;
        open_stage(&stage);
        uint64_t before = gl_hostile_calls();
        assert_true(try_it(&stage, trial, &expected, &err));
        uint64_t calls = gl_hostile_calls() - before;
        close_stage(&stage);
        print_message("%s: %llu calls\n", name_of(trial), (unsigned long long)calls);
        for (int n = 0; n < FIRST + SPREAD; n++)
            lose_in(trial, loss(n, calls), expected);
    }
}

static void a_renderer_is_not_made_of_a_lost_context(void **state)
{
    (void)state;
    struct error err = {0};
    gl_hostile_lose_after(0);
    uint64_t before = gl_hostile_calls();
    struct renderer *renderer = render_rig_create();
    uint64_t calls = gl_hostile_calls() - before;
    renderer_destroy(renderer);
    for (int n = 0; n < FIRST + SPREAD; n++) {
        err = (struct error){0};
        gl_hostile_lose_after(loss(n, calls));
        renderer = renderer_create(&(struct renderer_desc){.is_strict = true}, &err);
        if (!renderer && err.code != ERROR_NO_DEVICE)
            fail_msg("lost after %llu of %llu calls: %d, %s", (unsigned long long)loss(n, calls),
                     (unsigned long long)calls, (int)err.code, err.message);
        renderer_destroy(renderer); /* where the last calls are asked for nothing */
        gl_hostile_lose_after(0);
    }
    renderer = render_rig_create();
    renderer_destroy(renderer);
}

static void a_frame_in_flight_is_told_that_its_context_was_lost(void **state)
{
    (void)state;
    struct stage stage;
    struct frame frame = {0};
    struct error err = {0};
    const struct view view = view_of(0);
    bool is_done;
    gl_hostile_lose_after(0);
    stage.renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.defers_frames = true});
    rig_demo_open_fine(&stage.demo, stage.renderer, "demo", 64);
    assert_true(renderer_submit(stage.renderer, stage.demo.key, &view, &frame, &is_done, &err));
    assert_false(is_done);
    gl_hostile_lose_after(1);
    assert_true(renderer_wait(stage.renderer, 1000));
    assert_false(renderer_collect(stage.renderer, &err));
    if (err.code != ERROR_NO_DEVICE)
        fail_msg("%d, %s", (int)err.code, err.message);
    frame_finish(&frame);
    close_stage(&stage);
    gl_hostile_lose_after(0);
}

int main(void)
{
    alarm(ALARM_S);
    gl_hooks_install(&(struct gl_hooks_desc){.hostility = {.lost_after = UINT64_MAX}});
    struct renderer *renderer = render_rig_create(); /* or the program is skipped */
    renderer_destroy(renderer);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_loses_its_context_fails_for_lack_of_a_device),
        cmocka_unit_test(a_renderer_is_not_made_of_a_lost_context),
        cmocka_unit_test(a_frame_in_flight_is_told_that_its_context_was_lost),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

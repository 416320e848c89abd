/* SPDX-License-Identifier: MIT */
/* The budget is kept whatever frames ask for, between their passes and after them: windows become
 * so small that what they hold fits beside scenes and shadow structures, and the picture stays what
 * it is with ample memory. */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/yield_point.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/image_checks.h"

static const struct technique {
    const char *name;
    enum shadow_technique shadows;
} techniques[] = {
    {"none", SHADOWS_NONE},
    {"deep", SHADOWS_DEEP},
    {"deep-linked", SHADOWS_DEEP_LINKED},
    {"raytraced-shadows", SHADOWS_RAYTRACED_SHADOWS},
};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

static const struct size {
    int width, height;
} large = {320, 180}, small = {96, 64};

/* A renderer, and what of its budget is taken whenever its frames may stop for others. */
struct fixture {
    struct renderer *renderer;
    struct rig_scene demo;
    uint64_t budget_bytes, most_bytes;
    struct yield_point yield;
    pthread_t thread;
    const struct view *urgent; /* rendered in the next pause; NULL: none is due */
    int steps, urgent_at, urgent_made;
};

static void note_bytes(struct fixture *fixture)
{
    struct renderer_info info;
    renderer_get_info(fixture->renderer, &info);
    if (fixture->most_bytes < info.used_bytes)
        fixture->most_bytes = info.used_bytes;
}

/* Rays ask from other threads, too. */
static bool is_due(void *context)
{
    struct fixture *fixture = context;
    if (!pthread_equal(pthread_self(), fixture->thread))
        return false;
    note_bytes(fixture);
    return fixture->urgent && ++fixture->steps >= fixture->urgent_at;
}

static bool serve(void *context, struct error *why)
{
    (void)why;
    struct fixture *fixture = context;
    const struct view *view = fixture->urgent;
    struct frame frame;
    struct error err = {0};
    fixture->urgent = NULL;
    if (!renderer_render(fixture->renderer, fixture->demo.key, view, &frame, &err))
        fail_msg("in a pause: %s", err.message);
    if (view->quality.shadows == SHADOWS_RAYTRACED) /* its structure exceeds it meanwhile */
        fixture->most_bytes = 0;
    note_bytes(fixture);
    frame_finish(&frame);
    fixture->urgent_made++;
    return true;
}

static void fixture_init(struct fixture *fixture, uint64_t budget_bytes)
{
    struct error err = {0};
    *fixture = (struct fixture){.budget_bytes = budget_bytes, .thread = pthread_self()};
    fixture->renderer = renderer_create(
        &(struct renderer_desc){.gpu_budget_bytes = budget_bytes, .is_strict = true}, &err);
    if (!fixture->renderer && err.code == ERROR_NO_DEVICE)
        skip();
    assert_non_null(fixture->renderer);
    fixture->yield =
        (struct yield_point){.context = fixture, .should_yield = is_due, .run_urgent = serve};
    renderer_set_yield_point(fixture->renderer, &fixture->yield);
    rig_demo_open(&fixture->demo, fixture->renderer, "demo", 128);
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

static struct view view_of(const struct technique *technique, const struct size *size)
{
    return (struct view){.width_px = size->width,
                         .height_px = size->height,
                         .quality = {.shadows = technique->shadows, .shadow_resolution = 64}};
}

/* What is taken must be within the budget all the time. False when the frame is refused. */
static bool take(struct fixture *fixture, const struct view *view, struct frame *frame,
                 struct error *err)
{
    fixture->most_bytes = 0;
    bool is_made = renderer_render(fixture->renderer, fixture->demo.key, view, frame, err);
    note_bytes(fixture);
    print_message("%4llu MiB, %4d x %3d, shadows %d: at most %11llu bytes; %s\n",
                  (unsigned long long)fixture->budget_bytes >> 20, view->width_px, view->height_px,
                  (int)view->quality.shadows, (unsigned long long)fixture->most_bytes,
                  !is_made                      ? err->message
                  : frame->report.warning_count ? frame->report.warnings[0]
                                                : "in one window");
    if (fixture->most_bytes > fixture->budget_bytes)
        fail_msg("%llu bytes are taken", (unsigned long long)fixture->most_bytes);
    if (is_made)
        assert_true(frame->report.resident_bytes <= fixture->budget_bytes);
    return is_made;
}

static struct image take_color(struct fixture *fixture, const struct view *view, bool *is_split)
{
    struct frame frame;
    struct error err = {0};
    if (!take(fixture, view, &frame, &err))
        fail_msg("%s", err.message);
    struct image color = frame.outputs[VIEW_OUTPUT_COLOR];
    frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
    *is_split = report_has_warning(&frame.report, "to keep within the GPU budget of");
    assert_int_equal(frame.report.warning_count > 0, *is_split);
    frame_finish(&frame);
    return color;
}

/* Pictures of both sizes by each technique, large ones first. */
struct pictures {
    struct image color[TECHNIQUES][2];
};

static struct view view_at(int technique, int size)
{
    return view_of(&techniques[technique], size ? &small : &large);
}

static void pictures_finish(struct pictures *pictures)
{
    for (int i = 0; i < 2 * TECHNIQUES; i++)
        image_finish(&pictures->color[i / 2][i % 2]);
}

static void compare(const struct pictures *tight, const struct pictures *ample, int technique,
                    int size, bool is_split, uint64_t budget_mib)
{
    const struct image *a = &tight->color[technique][size], *b = &ample->color[technique][size];
    char scene[64];
    if (!is_split) {
        assert_same_bits(a, b);
        return;
    }
    snprintf(scene, sizeof scene, "demo, windows of %d MiB", (int)budget_mib);
    extreme_expect(&(struct extreme_row){scene, techniques[technique].name, "RMSE, relative", 1e-2},
                   extreme_rmse(a, b));
    assert_true(image_share_differing(a, b, 1e-2, 1e-2) < 2e-3);
}

static void every_technique_keeps_every_budget(void **state)
{
    (void)state;
    static const uint64_t budgets_mib[] = {0, 128, 32, 20};
    struct pictures ample;
    for (int b = 0; b < 4; b++) {
        struct pictures tight;
        struct fixture fixture;
        int split = 0;
        fixture_init(&fixture, budgets_mib[b] ? budgets_mib[b] << 20 : 4ull << 30);
        for (int i = 0; i < 2 * TECHNIQUES; i++) { /* small ones between large ones */
            bool is_split;
            struct view view = view_at(i / 2, i % 2);
            tight.color[i / 2][i % 2] = take_color(&fixture, &view, &is_split);
            split += is_split;
            if (b)
                compare(&tight, &ample, i / 2, i % 2, is_split, budgets_mib[b]);
        }
        assert_int_in_range(split, b >= 2 ? 1 : 0, b < 2 ? 0 : 2 * TECHNIQUES);
        if (b)
            pictures_finish(&tight);
        else
            ample = tight;
        fixture_finish(&fixture);
    }
    pictures_finish(&ample);
}

/* The ray tracer's structure alone is larger. */
static void what_cannot_fit_is_refused_and_says_what_takes_it(void **state)
{
    (void)state;
    struct fixture fixture;
    struct view view = view_of(&techniques[3], &small), plain = view_of(&techniques[0], &small);
    struct frame frame;
    struct error err = {0};
    bool is_split;
    fixture_init(&fixture, 8 << 20);
    rig_scene_finish(&fixture.demo, fixture.renderer);
    rig_demo_open_fine(&fixture.demo, fixture.renderer, "demo", 128);
    struct image before = take_color(&fixture, &plain, &is_split);
    assert_false(take(&fixture, &view, &frame, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "of rays"));
    assert_non_null(strstr(err.message, "the budget is 8388608 bytes"));
    struct image after = take_color(&fixture, &plain, &is_split);
    assert_same_bits(&before, &after);
    image_finish(&before);
    image_finish(&after);
    fixture_finish(&fixture);
}

/* A picture without shadows may fill the budget; what it leaves makes place for structures, and for
 * other outputs. */
static void what_is_kept_of_views_goes_first(void **state)
{
    (void)state;
    struct fixture fixture;
    bool is_split;
    fixture_init(&fixture, 20 << 20);
    for (int i = 0; i < 2; i++) {
        struct view view = view_of(&techniques[0], &large);
        struct image color = take_color(&fixture, &view, &is_split);
        image_finish(&color);
        view = view_of(&techniques[1], &large);
        view.quality.shadow_resolution = 256;
        struct frame frame;
        struct error err = {0};
        if (!take(&fixture, &view, &frame, &err))
            fail_msg("%s", err.message);
        frame_finish(&frame);
        view.outputs = (1u << VIEW_OUTPUT_COUNT) - 1;
        if (!take(&fixture, &view, &frame, &err))
            fail_msg("%s", err.message);
        frame_finish(&frame);
    }
    fixture_finish(&fixture);
}

/* A frame that goes first while another waits in the midst of its windows. */
static void frames_in_pauses_keep_the_budget(void **state)
{
    (void)state;
    struct fixture fixture;
    fixture_init(&fixture, 16 << 20);
    struct view view = view_of(&techniques[1], &large);
    bool is_split;
    struct image plain = take_color(&fixture, &view, &is_split);
    for (int t = 0; t < 3; t++)
        for (int at = 2; at < 18; at += 4) {
            struct view urgent = view_of(&techniques[t], &small);
            if (t == 2) /* whose structure is gone before the other goes on */
                urgent.quality.shadows = SHADOWS_RAYTRACED;
            fixture.urgent = &urgent;
            fixture.steps = 0;
            fixture.urgent_at = at;
            struct frame frame;
            struct error err = {0};
            if (!take(&fixture, &view, &frame, &err))
                fail_msg("%s", err.message);
            assert_true(extreme_rmse(&frame.outputs[VIEW_OUTPUT_COLOR], &plain) < 1e-2);
            frame_finish(&frame);
        }
    assert_int_equal(fixture.urgent_made, 12);
    image_finish(&plain);
    fixture_finish(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_technique_keeps_every_budget),
        cmocka_unit_test(what_cannot_fit_is_refused_and_says_what_takes_it),
        cmocka_unit_test(what_is_kept_of_views_goes_first),
        cmocka_unit_test(frames_in_pauses_keep_the_budget),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

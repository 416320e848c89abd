/* SPDX-License-Identifier: MIT */
/* Frames whose memory goes to others while they are paused: they have the bits of frames that were
 * made with what is left, or end with the reason. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/frame/renderer_internal.h"
#include "renderer/shadows/shadows_internal.h"
#include "renderer/textures/texture_store_internal.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

enum { RESOLUTION = 256, LIGHTS = 6 };

/* The pause after which less of a budget is left. */
struct loss {
    struct renderer *renderer;
    const struct rig_scene *other; /* drawn in the pause */
    uint64_t *budget_bytes, left_bytes;
    int at, pauses; /* at: the pause, from 1; pauses: so far */
};

static bool is_due(void *context)
{
    const struct loss *loss = context;
    return loss->pauses < loss->at;
}

static bool serve(void *context, struct error *err)
{
    (void)err;
    struct loss *loss = context;
    const struct view view = {
        .width_px = 32, .height_px = 32, .quality = {.shadows = SHADOWS_NONE, .samples = 1}};
    if (++loss->pauses < loss->at)
        return true;
    struct image color = shoot_color(loss->renderer, loss->other, &view);
    image_finish(&color);
    shadow_system_forget(loss->renderer->shadows, "demo");
    *loss->budget_bytes = loss->left_bytes;
    return true;
}

struct fixture {
    struct renderer *renderer;
    struct rig_scene demo, panes;
};

static void fixture_init(struct fixture *fixture, uint64_t texture_budget_bytes)
{
    struct closed_form_scene scene;
    struct error err = {0};
    fixture->renderer =
        renderer_create(&(struct renderer_desc){.is_strict = true,
                                                .hooks.first_slice = 512,
                                                .texture_budget_bytes = texture_budget_bytes},
                        &err);
    if (!fixture->renderer)
        fail_msg("%s", err.message);
    rig_demo_open_fine(&fixture->demo, fixture->renderer, "demo", 64);
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 9, .seed = 5}, &scene);
    rig_scene_open(&fixture->panes, fixture->renderer, "panes", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->panes, fixture->renderer);
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

static struct view demo_view(enum shadow_technique shadows)
{
    return (struct view){.width_px = 64,
                         .height_px = 40,
                         .quality = {.shadows = shadows, .shadow_resolution = RESOLUTION}};
}

/* Lights of one kind, whose structures are of one size. */
static struct view lit_view(struct view_light lights[LIGHTS])
{
    struct view view = demo_view(SHADOWS_DEEP);
    for (int i = 0; i < LIGHTS; i++)
        lights[i] = (struct view_light){.type = SCENE_LIGHT_DIRECTIONAL,
                                        .direction = {0.4 * i - 1, -1, 0.3 * i - 1},
                                        .color = {1, 0.2 * i, 0.5},
                                        .intensity = 1};
    view.lights = lights;
    view.light_count = LIGHTS;
    view.ignore_scene_lights = true;
    return view;
}

/* Renders with a loss; returns whether it happened before the frame was done. */
static bool render_with_loss(struct fixture *fixture, const struct view *view, struct loss *loss,
                             struct frame *frame, bool *is_good, struct error *err)
{
    const struct yield_point yield = {.context = loss, .should_yield = is_due, .run_urgent = serve};
    uint64_t before = *loss->budget_bytes;
    renderer_set_yield_point(fixture->renderer, &yield);
    *is_good = renderer_render(fixture->renderer, "demo", view, frame, err);
    renderer_set_yield_point(fixture->renderer, NULL);
    *loss->budget_bytes = before;
    return loss->pauses == loss->at;
}

/* Structures that stand together, or in batches of many, with room for few of them after a pause:
 * whenever that is, the picture is whole. from_bytes, to_bytes: of the budget of shadows. */
static void assert_batches_follow(struct fixture *fixture, uint64_t from_bytes, uint64_t to_bytes)
{
    struct view_light lights[LIGHTS];
    const struct view view = lit_view(lights);
    uint64_t *budget_bytes = &fixture->renderer->shadow_most_bytes;
    struct frame plain, paused;
    bool is_lost = true, is_good = false;
    uint64_t batches, more = 0;
    *budget_bytes = from_bytes;
    shoot(fixture->renderer, &fixture->demo, &view, &plain);
    batches = plain.report.counts.light_batches;
    for (int at = 1; is_lost; at++) {
        struct loss loss = {.renderer = fixture->renderer,
                            .other = &fixture->panes,
                            .budget_bytes = budget_bytes,
                            .left_bytes = to_bytes,
                            .at = at};
        struct error err = {0};
        fixture->renderer->frames.batches = (struct light_batches){0};
        renderer_drop_structures(fixture->renderer, "demo");
        is_lost = render_with_loss(fixture, &view, &loss, &paused, &is_good, &err);
        if (!is_good)
            fail_msg("less memory after pause %d: %s", at, err.message);
        assert_same_bits(&plain.outputs[VIEW_OUTPUT_COLOR], &paused.outputs[VIEW_OUTPUT_COLOR]);
        assert_int_equal(paused.report.counts.shadowed_lights, plain.report.counts.shadowed_lights);
        assert_int_equal(paused.report.counts.events, plain.report.counts.events);
        assert_int_equal(paused.report.counts.lookups, plain.report.counts.lookups);
        if (!is_lost)
            assert_int_equal(paused.report.counts.light_batches, batches);
        more += paused.report.counts.light_batches > batches;
        frame_finish(&paused);
    }
    assert_int_in_range(more, 7, 100); /* five steps, and pieces of them */
    frame_finish(&plain);
}

static void structures_that_no_longer_fit_together_are_used_in_batches(void **state)
{
    struct fixture fixture;
    (void)state;
    fixture_init(&fixture, 0);
    assert_batches_follow(&fixture, 64 << 20, 5 << 18);
    fixture_finish(&fixture);
}

static void batches_that_no_longer_fit_become_smaller(void **state)
{
    struct fixture fixture;
    (void)state;
    fixture_init(&fixture, 0);
    assert_batches_follow(&fixture, 10 << 18, 5 << 18);
    fixture_finish(&fixture);
}

/* Rays stop for others, too: what fails then is told as it is. */
static void what_fails_in_a_pause_of_shadow_rays_is_told(void **state)
{
    struct view view = demo_view(SHADOWS_RAYTRACED_SHADOWS);
    struct fixture fixture;
    struct frame frame;
    bool is_lost = true, is_good = false;
    int at = 1;
    (void)state;
    fixture_init(&fixture, 32 << 10);
    view.width_px = view.height_px = 96; /* 36 tiles */
    for (; is_lost; at++) {
        struct loss loss = {.renderer = fixture.renderer,
                            .other = &fixture.panes,
                            .budget_bytes = &fixture.renderer->scenes.textures->budget_bytes,
                            .left_bytes = 1,
                            .at = at};
        struct error err = {0};
        is_lost = render_with_loss(&fixture, &view, &loss, &frame, &is_good, &err);
        assert_int_equal(is_good, !is_lost);
        if (is_lost && err.code != ERROR_OVER_BUDGET)
            fail_msg("no textures after pause %d: %s", at, err.message);
        frame_finish(&frame);
    }
    assert_int_in_range(at, 11, 10000); /* tiles of rays among them */
    fixture_finish(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(structures_that_no_longer_fit_together_are_used_in_batches),
        cmocka_unit_test(batches_that_no_longer_fit_become_smaller),
        cmocka_unit_test(what_fails_in_a_pause_of_shadow_rays_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

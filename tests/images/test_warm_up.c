/* SPDX-License-Identifier: MIT */
/* What is built before a frame is drawn: all that the frame would build, whatever `auto` takes for
 * it, and nothing of what is kept is lost. Held with counters. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

enum { SIDE = 48 };

/* Speeds of devices that differ in what is fast (tests/gpu/test_calibrate.c). */
static const struct auto_settings raster = {.policy = AUTO_MEASURED,
                                            .speed = {0.01, 1e-3, 1e-3, 1, 1}};
static const struct auto_settings rays = {.policy = AUTO_MEASURED, .speed = {1, 1, 1, 0.01, 0.01}};
static const struct auto_settings traced_shadows = {.policy = AUTO_MEASURED,
                                                    .speed = {0.01, 0.01, 1e3, 1, 1}};
static const struct auto_settings only_rays = {.policy = AUTO_RAYTRACED};

struct fixture {
    struct renderer *renderer; /* its own: nothing stands */
    struct rig_scene demo;
};

static void fixture_init(struct fixture *fixture, const struct auto_settings *settings)
{
    *fixture = (struct fixture){.renderer = render_rig_create()};
    rig_demo_open(&fixture->demo, fixture->renderer, "demo", 64);
    renderer_set_auto(fixture->renderer, settings);
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

static struct view view_of(enum shadow_technique shadows)
{
    return (struct view){.width_px = SIDE,
                         .height_px = SIDE,
                         .camera = {.kind = VIEW_CAMERA_FIT},
                         .quality = {.shadows = shadows}};
}

static int count_trees(const struct frame_report *report)
{
    int count = 0;
    for (int i = 0; i < report->pass_count; i++)
        count += strcmp(report->passes[i].pass, "raytrace.build") == 0;
    return count;
}

struct built {
    uint64_t maps;
    int trees;
};

static struct built build(struct fixture *fixture, const struct view *view)
{
    struct frame frame;
    struct error err = {0};
    struct auto_choice choice;
    const struct view chosen = rig_choose(fixture->renderer, fixture->demo.key, view, &choice);
    if (!renderer_build(fixture->renderer, fixture->demo.key, &chosen, &frame, &err))
        fail_msg("%s", err.message);
    struct built built = {frame.report.counts.shadow_maps_built, count_trees(&frame.report)};
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        assert_null(frame.outputs[i].pixels);
    assert_int_equal(0, frame.report.counts.gbuffers_drawn);
    frame_finish(&frame);
    return built;
}

static bool never(void *context)
{
    (void)context;
    return false;
}

static void compile(struct fixture *fixture, const struct view *view)
{
    static const struct renderer_warm_up_desc desc = {.shall_stop = never};
    struct error err = {0};
    bool is_complete = false;
    if (!renderer_warm_up(fixture->renderer, fixture->demo.key, view, &desc, &is_complete, &err))
        fail_msg("%s", err.message);
    assert_true(is_complete);
}

static uint64_t programs_built(const struct fixture *fixture)
{
    struct renderer_info info;
    renderer_get_info(fixture->renderer, &info);
    return info.programs_built;
}

static void check_first_frame(const struct auto_settings *settings, struct built expected,
                              bool is_traced, bool has_traced_shadows)
{
    struct fixture fixture;
    struct frame frame;
    struct view view = view_of(SHADOWS_AUTO);
    fixture_init(&fixture, settings);
    struct built built = build(&fixture, &view);
    assert_int_equal(expected.maps > 0, built.maps > 0);
    assert_int_equal(expected.trees, built.trees);
    compile(&fixture, &view);
    shoot(fixture.renderer, &fixture.demo, &view, &frame);
    assert_int_equal(is_traced, frame.report.chosen.shadows == SHADOWS_RAYTRACED);
    assert_int_equal(has_traced_shadows, frame.report.chosen.shadows == SHADOWS_RAYTRACED_SHADOWS);
    assert_int_equal(0, frame.report.counts.programs_built);
    assert_int_equal(0, frame.report.counts.shadow_maps_built);
    assert_int_equal(built.maps, frame.report.counts.shadow_maps_reused);
    assert_int_equal(0, count_trees(&frame.report));
    frame_finish(&frame);
    fixture_finish(&fixture);
}

static void whatever_auto_takes_is_there_for_the_first_frame(void **state)
{
    (void)state;
    check_first_frame(&raster, (struct built){.maps = 1}, false, false);
    check_first_frame(&rays, (struct built){.trees = 1}, true, false);
    check_first_frame(&traced_shadows, (struct built){.trees = 1}, false, true);
}

/* A camera that makes `auto` choose otherwise finds its programs, and so does a background. */
static void programs_of_the_other_choices_are_compiled(void **state)
{
    (void)state;
    static const enum shadow_technique others[] = {SHADOWS_DEEP, SHADOWS_RAYTRACED_SHADOWS};
    struct fixture fixture;
    fixture_init(&fixture, &rays);
    struct view view = view_of(SHADOWS_AUTO);
    compile(&fixture, &view);
    uint64_t built = programs_built(&fixture);
    for (int i = 0; i < 4; i++) {
        struct frame frame;
        struct view other = view_of(others[i % 2]);
        other.background[3] = 1;
        other.screen.has_backdrop = i / 2;
        shoot(fixture.renderer, &fixture.demo, &other, &frame);
        assert_true(frame.report.counts.programs_reused > 0);
        frame_finish(&frame);
    }
    assert_int_equal(built, programs_built(&fixture));
    fixture_finish(&fixture);
}

static void where_all_is_traced_nothing_is_compiled(void **state)
{
    (void)state;
    struct fixture fixture;
    fixture_init(&fixture, &only_rays);
    struct view view = view_of(SHADOWS_AUTO);
    uint64_t before = programs_built(&fixture);
    compile(&fixture, &view);
    assert_int_equal(before, programs_built(&fixture));
    fixture_finish(&fixture);
}

static void building_leaves_what_was_drawn(void **state)
{
    (void)state;
    struct fixture fixture;
    struct frame frame;
    fixture_init(&fixture, &raster);
    struct view bare = view_of(SHADOWS_NONE), deep = view_of(SHADOWS_DEEP);
    struct view traced = view_of(SHADOWS_RAYTRACED);
    struct image before = shoot_color(fixture.renderer, &fixture.demo, &bare);
    deep.width_px = traced.width_px = 2 * SIDE;
    deep.quality.shadow_resolution = 64;
    assert_true(build(&fixture, &deep).maps > 0);
    assert_int_equal(1, build(&fixture, &traced).trees);
    assert_int_equal(0, build(&fixture, &deep).maps); /* they stand */
    assert_int_equal(0, build(&fixture, &traced).trees);
    shoot(fixture.renderer, &fixture.demo, &bare, &frame);
    assert_int_equal(1, frame.report.counts.gbuffers_reused);
    assert_int_equal(1, frame.report.counts.pixel_lists_reused);
    assert_int_equal(image_hash(&before), image_hash(&frame.outputs[VIEW_OUTPUT_COLOR]));
    frame_finish(&frame);
    image_finish(&before);
    fixture_finish(&fixture);
}

static bool always(void *context)
{
    (void)context;
    return true;
}

static bool gives_way(void *context, struct error *err)
{
    (void)context;
    (void)err;
    return false;
}

static void building_gives_way(void **state)
{
    (void)state;
    static const struct yield_point someone = {.should_yield = always, .run_urgent = gives_way};
    struct fixture fixture;
    struct frame frame;
    struct error err = {0};
    fixture_init(&fixture, &raster);
    struct view view = view_of(SHADOWS_DEEP);
    view.quality.shadow_resolution = 64;
    renderer_set_yield_point(fixture.renderer, &someone);
    assert_false(renderer_build(fixture.renderer, fixture.demo.key, &view, &frame, &err));
    assert_int_equal(ERROR_OVERLOADED, err.code);
    renderer_set_yield_point(fixture.renderer, NULL);
    uint64_t left = build(&fixture, &view).maps;
    assert_true(left > 0);
    fixture_finish(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whatever_auto_takes_is_there_for_the_first_frame),
        cmocka_unit_test(programs_of_the_other_choices_are_compiled),
        cmocka_unit_test(where_all_is_traced_nothing_is_compiled),
        cmocka_unit_test(building_leaves_what_was_drawn),
        cmocka_unit_test(building_gives_way),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

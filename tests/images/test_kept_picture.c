/* SPDX-License-Identifier: MIT */
/* What is drawn over a picture needs none of it again, where our own processors keep it and where
 * the device does: the passes and counts tell, and the bits are those of a frame that drew all of
 * it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

enum { STEPS_MAX = 8 };

static const char *const vessel[] = {"Vessel"}, *const pane[] = {"#2"};

struct fixture {
    struct renderer *renderer;
    struct rig_scene demo;
    bool is_software;
};

/* A view in a sequence, and whether its picture was kept from the one before. */
struct step {
    struct view view;
    bool is_kept;
};

static void fixture_init(struct fixture *fixture, bool poses_as_hardware)
{
    struct renderer_info info;
    fixture->renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.poses_as_hardware = poses_as_hardware});
    renderer_get_info(fixture->renderer, &info);
    fixture->is_software = info.is_software;
    rig_demo_open(&fixture->demo, fixture->renderer, "demo", 64);
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

static struct view base_view(enum shadow_technique shadows)
{
    return (struct view){
        .width_px = 120,
        .height_px = 80,
        .background = {0.1f, 0.2f, 0.3f, 1},
        .quality = {.shadows = shadows, .shadow_resolution = 64, .expects_reuse = true}};
}

static struct view highlighted(struct view view, const char *const *nodes)
{
    view.highlight = (struct view_highlight){
        .nodes = nodes, .node_count = 1, .color = {1, 0.3f, 0}, .width_px = 2, .hidden = 0.3f};
    return view;
}

static struct view edged(struct view view)
{
    view.edges = (struct view_edges){.is_drawn = true, .crease_deg = 30, .width_px = 1};
    return view;
}

static bool has_reused(const struct frame_report *report, const char *what)
{
    for (int i = 0; i < report->reused_count; i++)
        if (strcmp(report->reused[i], what) == 0)
            return true;
    return false;
}

/* Of a picture that was kept, it was sent and drawn over, no more. */
static bool is_after_shading(const char *pass)
{
    return strcmp(pass, "readback") == 0 || strncmp(pass, "overlay.", 8) == 0;
}

static void check_work(const struct frame_report *report, bool is_kept)
{
    bool has_shaded = false;
    for (int i = 0; i < report->pass_count; i++)
        has_shaded |= !is_after_shading(report->passes[i].pass);
    assert_int_equal(is_kept, !has_shaded);
    assert_int_equal(is_kept, report->is_kept_picture);
    assert_int_equal(is_kept, has_reused(report, "picture"));
    if (is_kept)
        assert_int_equal(0, report->counts.lookups + report->counts.shadow_rays +
                                report->counts.draws + report->counts.gbuffers_drawn +
                                report->counts.shadow_maps_built);
}

static void check_frame(const struct frame *expected, const struct frame *frame, bool is_kept)
{
    const struct frame_report *a = &expected->report, *b = &frame->report;
    const struct image *picture = &frame->outputs[VIEW_OUTPUT_COLOR];
    assert_int_equal(expected->outputs[VIEW_OUTPUT_COLOR].component, picture->component);
    assert_same_bits(&expected->outputs[VIEW_OUTPUT_COLOR], picture);
    assert_int_equal(a->error_is_exact, b->error_is_exact);
    assert_int_equal(a->warning_count, b->warning_count);
    assert_int_equal(a->counts.lights, b->counts.lights);
    assert_int_equal(a->counts.outlined_pixels, b->counts.outlined_pixels);
    check_work(b, is_kept);
}

/* Each view by itself first, because those take the place of what is kept. */
static void check(const struct fixture *fixture, const struct step *steps, int count)
{
    struct frame expected[STEPS_MAX], frame;
    for (int i = 0; i < count; i++) {
        struct view alone = steps[i].view;
        alone.quality.expects_reuse = false;
        shoot(fixture->renderer, &fixture->demo, &alone, &expected[i]);
        check_work(&expected[i].report, false);
    }
    for (int i = 0; i < count; i++) {
        shoot(fixture->renderer, &fixture->demo, &steps[i].view, &frame);
        check_frame(&expected[i], &frame, steps[i].is_kept);
        frame_finish(&frame);
        frame_finish(&expected[i]);
    }
}

#define CHECK(fixture, ...)                            \
    check(fixture, (const struct step[]){__VA_ARGS__}, \
          (int)(sizeof(const struct step[]){__VA_ARGS__} / sizeof(struct step)))

static void select_and_deselect(const struct fixture *fixture, const struct view *base)
{
    CHECK(fixture, {*base, false}, {highlighted(*base, vessel), true},
          {highlighted(*base, pane), true}, {edged(highlighted(*base, pane)), true},
          {edged(*base), true}, {*base, true}, {highlighted(*base, pane), true});
}

static void selecting_draws_nothing_but_the_outline(void **state)
{
    static const enum shadow_technique techniques[] = {
        SHADOWS_NONE, SHADOWS_DEEP, SHADOWS_RAYTRACED, SHADOWS_RAYTRACED_SHADOWS};
    struct fixture fixture;
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        fixture_init(&fixture, poses);
        for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
            const struct view base = base_view(techniques[i]);
            select_and_deselect(&fixture, &base);
        }
        fixture_finish(&fixture);
    }
}

static void pictures_for_the_screen_are_kept_linear(void **state)
{
    struct fixture fixture;
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        fixture_init(&fixture, poses);
        for (int backdrop = 0; backdrop < 2; backdrop++) {
            struct view base = base_view(SHADOWS_DEEP);
            base.screen.channels = 3;
            base.screen.has_backdrop = backdrop;
            select_and_deselect(&fixture, &base);
        }
        fixture_finish(&fixture);
    }
}

static void the_first_picture_may_have_an_outline(void **state)
{
    struct fixture fixture;
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        fixture_init(&fixture, poses);
        struct view base = base_view(SHADOWS_DEEP);
        base.screen.channels = 4;
        CHECK(&fixture, {highlighted(base, vessel), false}, {base, true},
              {highlighted(base, pane), true});
        fixture_finish(&fixture);
    }
}

static void what_changes_the_picture_draws_it_again(void **state)
{
    struct fixture fixture;
    static const double plane[1][4] = {{0, -1, 0, 3}};
    const struct view_light lamp = {
        .type = SCENE_LIGHT_POINT, .position = {0, 2, 1}, .color = {1, 1, 1}, .intensity = 80};
    const struct view_node_override hidden = {.node = "#2", .has_visible = true};
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        fixture_init(&fixture, poses);
        for (int change = 0; change < 8; change++) {
            const struct view before = highlighted(base_view(SHADOWS_DEEP), vessel);
            struct view view = before;
            view.camera.kind = change == 0 ? VIEW_CAMERA_FIT : VIEW_CAMERA_DEFAULT;
            view.background[0] = change == 1 ? 0.9f : 0.1f;
            view.lights = change == 2 ? &lamp : NULL;
            view.light_count = change == 2;
            view.nodes = change == 3 ? &hidden : NULL;
            view.node_override_count = change == 3;
            view.clip_planes = change == 4 ? plane : NULL;
            view.clip_plane_count = change == 4;
            view.quality.samples = change == 5 ? 1 : 0;
            view.screen.has_backdrop = change == 6;
            view.width_px += change == 7;
            CHECK(&fixture, {before, false}, {view, false}, {highlighted(view, pane), true});
        }
        fixture_finish(&fixture);
    }
}

static void other_frames_are_not_kept(void **state)
{
    struct fixture fixture;
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        fixture_init(&fixture, poses);
        struct view single = base_view(SHADOWS_DEEP), coarse = single;
        single.quality.expects_reuse = false;
        coarse.quality.may_be_coarse = true;
        CHECK(&fixture, {single, false}, {single, false}, {coarse, false}, {coarse, false});
        fixture_finish(&fixture);
    }
}

/* The device has one picture of a renderer; our own processors have a copy. */
static void a_frame_in_motion_takes_the_place_of_the_devices_picture(void **state)
{
    struct fixture fixture;
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        fixture_init(&fixture, poses);
        struct view base = base_view(SHADOWS_DEEP), coarse = base;
        coarse.quality.may_be_coarse = true;
        CHECK(&fixture, {base, false}, {coarse, false}, {base, fixture.is_software},
              {highlighted(base, pane), true});
        fixture_finish(&fixture);
    }
}

static void of_several_windows_a_copy_is_kept_once_it_has_come(void **state)
{
    struct fixture fixture;
    struct frame frame;
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        fixture_init(&fixture, poses);
        struct view base = base_view(SHADOWS_NONE);
        base.width_px = 4100; /* a window has at most 4096 */
        base.height_px = 4;
        base.quality.samples = 1;
        base.screen.channels = 3;
        CHECK(&fixture, {base, false}, {highlighted(base, pane), fixture.is_software},
              {highlighted(base, vessel), true});
        shoot(fixture.renderer, &fixture.demo, &base, &frame);
        check_work(&frame.report, true);
        assert_int_equal(IMAGE_F32, frame.outputs[VIEW_OUTPUT_COLOR].component);
        frame_finish(&frame);
        fixture_finish(&fixture);
    }
}

static void what_is_forgotten_is_drawn_again(void **state)
{
    struct fixture fixture;
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        fixture_init(&fixture, poses);
        struct view base = base_view(SHADOWS_DEEP);
        for (int how = 0; how < 2; how++) {
            base.background[0] = 0.2f * (float)how;
            CHECK(&fixture, {base, false}, {base, true});
            struct frame frame;
            if (how == 0)
                renderer_trim(fixture.renderer);
            else
                renderer_drop_structures(fixture.renderer, fixture.demo.key);
            shoot(fixture.renderer, &fixture.demo, &base, &frame);
            check_work(&frame.report, false);
            frame_finish(&frame);
        }
        fixture_finish(&fixture);
    }
}

/* What is in flight may still turn out wrong. */
static void a_picture_on_its_way_is_not_relied_on(void **state)
{
    struct error err = {0};
    struct frame flying, expected, frame;
    bool is_done = true;
    (void)state;
    struct fixture fixture = {
        .renderer = render_rig_create_as(&(struct renderer_desc){
            .is_strict = true, .hooks.poses_as_hardware = true, .hooks.defers_frames = true})};
    rig_demo_open(&fixture.demo, fixture.renderer, "demo", 64);
    const struct view base = base_view(SHADOWS_DEEP), selected = highlighted(base, pane);
    struct view alone = selected;
    alone.quality.expects_reuse = false;
    shoot(fixture.renderer, &fixture.demo, &alone, &expected);
    assert_true(
        renderer_submit(fixture.renderer, fixture.demo.key, &base, &flying, &is_done, &err));
    assert_false(is_done);
    shoot(fixture.renderer, &fixture.demo, &selected, &frame);
    check_frame(&expected, &frame, false);
    frame_finish(&frame);
    assert_true(renderer_collect(fixture.renderer, &err));
    frame_finish(&flying);
    shoot(fixture.renderer, &fixture.demo, &selected, &frame);
    check_frame(&expected, &frame, true);
    frame_finish(&frame);
    frame_finish(&expected);
    fixture_finish(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(selecting_draws_nothing_but_the_outline),
        cmocka_unit_test(pictures_for_the_screen_are_kept_linear),
        cmocka_unit_test(the_first_picture_may_have_an_outline),
        cmocka_unit_test(what_changes_the_picture_draws_it_again),
        cmocka_unit_test(other_frames_are_not_kept),
        cmocka_unit_test(a_frame_in_motion_takes_the_place_of_the_devices_picture),
        cmocka_unit_test(of_several_windows_a_copy_is_kept_once_it_has_come),
        cmocka_unit_test(what_is_forgotten_is_drawn_again),
        cmocka_unit_test(a_picture_on_its_way_is_not_relied_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

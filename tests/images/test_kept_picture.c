/* SPDX-License-Identifier: MIT */
/* What is drawn over a picture needs none of it again: the passes and counts tell, and the bits are
 * those of a frame that drew all of it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

static const char *const vessel[] = {"Vessel"}, *const pane[] = {"#2"};

struct fixture {
    struct renderer *renderer;
    struct rig_scene demo;
};

/* Whether its device keeps pictures. */
static bool fixture_init(struct fixture *fixture)
{
    struct renderer_info info;
    fixture->renderer = render_rig_create();
    renderer_get_info(fixture->renderer, &info);
    rig_demo_open(&fixture->demo, fixture->renderer, "demo", 64);
    return info.is_software;
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

static struct view base_view(enum view_shadows shadows)
{
    return (struct view){
        .width_px = 120,
        .height_px = 80,
        .background = {0.1f, 0.2f, 0.3f, 1},
        .quality = {.shadows = shadows, .shadow_resolution = 64, .expects_reuse = true}};
}

static void highlight(struct view *view, const char *const *nodes)
{
    view->highlight = (struct view_highlight){
        .nodes = nodes, .node_count = 1, .color = {1, 0.3f, 0}, .width_px = 2, .hidden = 0.3f};
}

static bool has_reused(const struct frame_report *report, const char *what)
{
    for (int i = 0; i < report->reused_count; i++)
        if (strcmp(report->reused[i], what) == 0)
            return true;
    return false;
}

/* The picture is right, and of one that is kept nothing was drawn but what lies over it. */
static void check(const struct fixture *fixture, const struct view *view, bool is_kept)
{
    struct frame frame, expected;
    struct view alone = *view;
    alone.quality.expects_reuse = false;
    shoot(fixture->renderer, &fixture->demo, view, &frame);
    shoot(fixture->renderer, &fixture->demo, &alone, &expected);
    assert_false(has_reused(&expected.report, "picture")); /* of a single frame */
    assert_same_bits(&expected.outputs[VIEW_OUTPUT_COLOR], &frame.outputs[VIEW_OUTPUT_COLOR]);
    const struct frame_report *report = &frame.report;
    assert_int_equal(is_kept, has_reused(report, "picture"));
    assert_int_equal(is_kept, report->is_kept_picture);
    assert_int_equal(expected.report.error_is_exact, report->error_is_exact);
    assert_int_equal(expected.report.warning_count, report->warning_count);
    assert_int_equal(expected.report.counts.lights, report->counts.lights);
    assert_int_equal(expected.report.counts.outlined_pixels, report->counts.outlined_pixels);
    for (int i = 0; is_kept && i < report->pass_count; i++)
        assert_int_equal(0, strncmp(report->passes[i].pass, "overlay.", 8));
    if (is_kept)
        assert_int_equal(0, report->counts.lookups + report->counts.shadow_rays +
                                report->counts.draws + report->counts.gbuffers_drawn +
                                report->counts.shadow_maps_built);
    else
        assert_int_not_equal(0, strncmp(report->passes[0].pass, "overlay.", 8));
    frame_finish(&frame);
    frame_finish(&expected);
}

static void selecting_draws_nothing_but_the_outline(void **state)
{
    static const enum view_shadows techniques[] = {VIEW_SHADOWS_NONE, VIEW_SHADOWS_DEEP,
                                                   VIEW_SHADOWS_RAYTRACED,
                                                   VIEW_SHADOWS_RAYTRACED_SHADOWS};
    struct fixture fixture;
    (void)state;
    bool keeps = fixture_init(&fixture);
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        struct view view = base_view(techniques[i]);
        check(&fixture, &view, false);
        highlight(&view, vessel);
        check(&fixture, &view, keeps);
        highlight(&view, pane);
        check(&fixture, &view, keeps);
        view.edges = (struct view_edges){.is_drawn = true, .crease_deg = 30, .width_px = 1};
        check(&fixture, &view, keeps);
        view.edges = (struct view_edges){0};
        view.highlight = (struct view_highlight){0};
        check(&fixture, &view, keeps);
    }
    fixture_finish(&fixture);
}

static void what_changes_the_picture_draws_it_again(void **state)
{
    struct fixture fixture;
    static const double plane[1][4] = {{0, -1, 0, 3}};
    const struct view_light lamp = {
        .type = SCENE_LIGHT_POINT, .position = {0, 2, 1}, .color = {1, 1, 1}, .intensity = 80};
    const struct view_node_override hidden = {.node = "#2", .has_visible = true};
    (void)state;
    fixture_init(&fixture);
    for (int change = 0; change < 8; change++) {
        struct view view = base_view(VIEW_SHADOWS_DEEP);
        highlight(&view, vessel);
        check(&fixture, &view, false);
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
        check(&fixture, &view, false);
    }
    fixture_finish(&fixture);
}

static void other_frames_are_not_kept(void **state)
{
    struct fixture fixture;
    (void)state;
    bool keeps = fixture_init(&fixture);
    struct view view = base_view(VIEW_SHADOWS_DEEP);
    view.quality.expects_reuse = false;
    check(&fixture, &view, false);
    check(&fixture, &view, false);
    view = base_view(VIEW_SHADOWS_DEEP);
    view.quality.may_be_coarse = true;
    check(&fixture, &view, false);
    check(&fixture, &view, false);
    view.quality.may_be_coarse = false;
    check(&fixture, &view, false);
    renderer_rest(fixture.renderer);
    check(&fixture, &view, false);
    check(&fixture, &view, keeps);
    fixture_finish(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(selecting_draws_nothing_but_the_outline),
        cmocka_unit_test(what_changes_the_picture_draws_it_again),
        cmocka_unit_test(other_frames_are_not_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

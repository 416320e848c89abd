/* SPDX-License-Identifier: MIT */
/* The plan tells what a frame will do: its passes are those that a cold frame then reports. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_media.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"
#include "tests/support/techniques.h"

enum { SIDE = 48 };

struct scene_case {
    struct rig_scene rig;
    struct closed_form_scene closed_form;
};

static void open_demo(struct scene_case *scene, struct renderer *renderer)
{
    rig_demo_open(&scene->rig, renderer, "demo", 64);
}

static void open_panes(struct scene_case *scene, struct renderer *renderer, int count)
{
    static const double colors[2][4] = {{0.8, 0.5, 0.25, 1}, {0.5, 1, 0.5, 1}};
    panes_scene_build(&(struct panes_scene_desc){.pane_count = count, .colors = colors},
                      &scene->closed_form);
    rig_scene_open(&scene->rig, renderer, "panes", scene->closed_form.glb,
                   scene->closed_form.size_bytes);
}

static void close_scene(struct scene_case *scene, struct renderer *renderer)
{
    rig_scene_finish(&scene->rig, renderer);
    closed_form_scene_finish(&scene->closed_form);
}

static bool plan_has(const struct plan *plan, const struct report_pass *line)
{
    for (int i = 0; i < plan->pass_count; i++)
        if (!strcmp(plan->passes[i].pass, line->pass) &&
            !strcmp(plan->passes[i].technique, line->technique))
            return true;
    return false;
}

/* Renders the view cold and holds the plan against the report, both ways. sees_all: every kind of
 * surface in reach is hit. */
static struct plan check_plan(struct renderer *renderer, struct scene_case *scene,
                              const struct view *view, bool sees_all)
{
    struct plan plan;
    struct frame frame;
    struct error err = {0};
    if (!renderer_explain(renderer, scene->rig.key, view, &plan, &err))
        fail_msg("%s", err.message);
    shoot(renderer, &scene->rig, view, &frame);
    const struct frame_report *report = &frame.report;
    for (int i = 0; i < report->pass_count; i++)
        if (!plan_has(&plan, &report->passes[i]))
            fail_msg("the frame ran %s (%s), which the plan lacks", report->passes[i].pass,
                     report->passes[i].technique);
    for (int i = 0; i < plan.pass_count; i++) {
        assert_true(plan.requirements[plan.passes[i].need].is_met);
        bool may_be_absent = plan.passes[i].is_conditional && !sees_all;
        if (!may_be_absent &&
            !report_has_pass(report, plan.passes[i].pass, plan.passes[i].technique))
            fail_msg("the plan has %s (%s), which did not run", plan.passes[i].pass,
                     plan.passes[i].technique);
    }
    if (!plan.requirements[PLAN_NEED_TRACED].is_met)
        assert_int_equal(report->counts.shadowed_lights,
                         plan_shadowed_lights(&plan) - plan.traced_lights);
    for (int i = 0; i < PLAN_NEED_COUNT; i++) {
        assert_int_equal(plan.requirements[i].need, i);
        assert_true(plan.requirements[i].because[0]);
    }
    frame_finish(&frame);
    return plan;
}

static struct view small_view(void)
{
    return (struct view){.width_px = SIDE, .height_px = SIDE, .quality = {.shadow_resolution = 64}};
}

static void a_cold_frame_runs_what_its_plan_lists(void **state)
{
    enum shadow_technique techniques[SHADOWS_COUNT];
    size_t count = raster_techniques(SHADOW_CAN_LINKED_LISTS, techniques);
    techniques[count++] = SHADOWS_AUTO; /* in the place of the ray tracer's */
    for (size_t i = 0; i < count; i++) {
        for (int samples = 1; samples <= 4; samples += 3) {
            struct scene_case scene = {0};
            open_demo(&scene, *state);
            struct view view = small_view();
            view.quality.shadows = techniques[i];
            view.quality.samples = samples;
            view.quality.light_lists =
                samples == 1 ? VIEW_LIGHT_LISTS_LINKED : VIEW_LIGHT_LISTS_CLUSTERED;
            check_plan(*state, &scene, &view, true);
            close_scene(&scene, *state); /* forgets its shadows: the next frame is cold again */
        }
    }
}

static void nothing_is_planned_that_the_scene_does_not_require(void **state)
{
    struct scene_case scene = {0};
    struct view view = small_view();
    view.camera.kind = VIEW_CAMERA_FIT; /* the scene's own camera sees the floor only */
    open_panes(&scene, *state, 0);
    struct plan plan = check_plan(*state, &scene, &view, false);
    assert_false(plan.requirements[PLAN_NEED_LAYERS].is_met);
    assert_false(plan.requirements[PLAN_NEED_FILTERED_SHADOWS].is_met);
    close_scene(&scene, *state);
    open_panes(&scene, *state, 2);
    plan = check_plan(*state, &scene, &view, false);
    assert_true(plan.requirements[PLAN_NEED_LAYERS].is_met);
    assert_true(plan.requirements[PLAN_NEED_FILTERED_SHADOWS].is_met);
    assert_int_equal(plan.lights_by_technique[SHADOWS_DEEP], 1);
    view.outputs = 1u << VIEW_OUTPUT_DEPTH | 1u << VIEW_OUTPUT_NODE;
    plan = check_plan(*state, &scene, &view, false);
    assert_false(plan.requirements[PLAN_NEED_COLOR].is_met);
    assert_false(plan.requirements[PLAN_NEED_LIGHTS].is_met);
    assert_int_equal(plan.lights_by_technique[SHADOWS_DEEP], 0);
    close_scene(&scene, *state);
    open_panes(&scene, *state, 2);
    view.outputs = 0;
    view.quality.shadows = SHADOWS_MAP;
    plan = check_plan(*state, &scene, &view, false);
    assert_false(plan.requirements[PLAN_NEED_FILTERED_SHADOWS].is_met);
    assert_non_null(strstr(plan.requirements[PLAN_NEED_FILTERED_SHADOWS].because, "is map"));
    close_scene(&scene, *state);
}

/* What nobody counted is not told as none. */
static void check_not_counted(const struct plan *plan)
{
    static const enum plan_need uncounted[] = {PLAN_NEED_SURFACES, PLAN_NEED_LAYERS,
                                               PLAN_NEED_OPAQUE_SHADOWS, PLAN_NEED_FILTERED_SHADOWS,
                                               PLAN_NEED_TRACED_SHADOWS};
    for (size_t i = 0; i < sizeof uncounted / sizeof *uncounted; i++) {
        assert_false(plan->requirements[uncounted[i]].is_met);
        assert_string_equal(plan->requirements[uncounted[i]].because,
                            "not counted: rays find surfaces, layers and shadows");
    }
    assert_non_null(strstr(plan->requirements[PLAN_NEED_LIGHTS].because, ", in no list"));
}

static void a_traced_frame_plans_no_shadow_map(void **state)
{
    struct scene_case scene = {0};
    struct view view = small_view();
    view.quality.shadows = SHADOWS_RAYTRACED;
    view.quality.samples = 1;
    open_panes(&scene, *state, 2);
    struct plan plan = check_plan(*state, &scene, &view, false);
    assert_true(plan.requirements[PLAN_NEED_TRACED].is_met);
    assert_int_equal(plan.shadow_texels, 0);
    check_not_counted(&plan);
    close_scene(&scene, *state);
}

static void check_known_memory(struct renderer *renderer, const struct scene_case *scene,
                               const struct view *view)
{
    struct frame frame;
    struct error err = {0};
    struct plan plan;
    assert_true(renderer_explain(renderer, scene->rig.key, view, &plan, &err));
    shoot(renderer, &scene->rig, view, &frame);
    uint64_t planned = 0, taken = report_bytes_of(&frame.report, "targets");
    for (int i = 0; i < plan.pass_count; i++)
        if (!strcmp(plan.passes[i].pass, "gbuffer"))
            planned = plan.passes[i].bytes;
    assert_true(taken > 0);
    assert_int_equal(planned, taken);
    frame_finish(&frame);
}

static void the_known_memory_is_what_the_frame_takes(void **state)
{
    struct scene_case scene = {0};
    struct view view = small_view();
    open_panes(&scene, *state, 2);
    check_known_memory(*state, &scene, &view);
    view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_DEPTH;
    view.quality.shadows = SHADOWS_RAYTRACED; /* the depth is rasterised, with one sample */
    check_known_memory(*state, &scene, &view);
    close_scene(&scene, *state);
}

static uint64_t plans_made(struct renderer *renderer, const struct scene_case *scene,
                           const struct view *view)
{
    struct frame frame;
    shoot(renderer, &scene->rig, view, &frame);
    uint64_t made = frame.report.counts.plans_made;
    assert_int_equal(made + frame.report.counts.plans_reused, 1);
    frame_finish(&frame);
    return made;
}

/* Only what decides the plan makes a new one; what it was decided from is kept with it. */
static void equal_views_share_one_plan(void **state)
{
    struct scene_case scene = {0};
    struct view view = small_view();
    struct view_light lamp = {
        .type = SCENE_LIGHT_POINT, .position = {0, 1, 2}, .color = {1, 1, 1}, .intensity = 50};
    view.lights = &lamp;
    view.light_count = 1;
    open_demo(&scene, *state);
    assert_int_equal(plans_made(*state, &scene, &view), 1);
    struct view_light same = lamp; /* the same content at another place */
    view.lights = &same;
    assert_int_equal(plans_made(*state, &scene, &view), 0);
    view.background[1] = 0.5f;
    assert_int_equal(plans_made(*state, &scene, &view), 0);
    same.position[0] = 0.25;
    assert_int_equal(plans_made(*state, &scene, &view), 1);
    view.quality.samples = 1;
    assert_int_equal(plans_made(*state, &scene, &view), 1);
    view.height_px++;
    assert_int_equal(plans_made(*state, &scene, &view), 1);
    close_scene(&scene, *state);
    open_demo(&scene, *state); /* a key may stand for another scene then */
    assert_int_equal(plans_made(*state, &scene, &view), 1);
    close_scene(&scene, *state);
}

/* Bodies of a medium are listed as layers are, also where they are all that there is. */
static void a_medium_calls_for_layers(void **state)
{
    static const struct closed_form_body ball = {
        .shape = BODY_BOX, .high = {1, 1, 1}, .remains = {0.5f, 0.25f, 0.0625f}, .distance = 0.25f};
    struct scene_case scene = {0};
    struct view view = small_view();
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_FIT};
    media_scene_build(&(struct media_scene_desc){.bodies = &ball, .count = 1}, &scene.closed_form);
    rig_scene_open(&scene.rig, *state, "medium", scene.closed_form.glb,
                   scene.closed_form.size_bytes);
    struct plan plan = check_plan(*state, &scene, &view, false);
    assert_true(plan.requirements[PLAN_NEED_LAYERS].is_met);
    assert_true(plan.transparent_items > 0);
    close_scene(&scene, *state);
}

static void an_unknown_node_is_named_without_drawing(void **state)
{
    struct scene_case scene = {0};
    struct error err = {0};
    struct plan plan;
    struct view view = small_view();
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_NODE, .node = "Nobody"};
    open_panes(&scene, *state, 1);
    assert_false(renderer_explain(*state, scene.rig.key, &view, &plan, &err));
    assert_non_null(strstr(err.message, "Nobody"));
    close_scene(&scene, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cold_frame_runs_what_its_plan_lists),
        cmocka_unit_test(nothing_is_planned_that_the_scene_does_not_require),
        cmocka_unit_test(a_traced_frame_plans_no_shadow_map),
        cmocka_unit_test(the_known_memory_is_what_the_frame_takes),
        cmocka_unit_test(equal_views_share_one_plan),
        cmocka_unit_test(a_medium_calls_for_layers),
        cmocka_unit_test(an_unknown_node_is_named_without_drawing),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

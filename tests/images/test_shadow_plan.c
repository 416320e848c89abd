/* SPDX-License-Identifier: MIT */
/* Shadows are modelled where the scene requires them, follow every edit, and are kept otherwise. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

static const double one_color[1][4] = {{0.8, 0.5, 0.25, 1}};

struct fixture {
    struct renderer *renderer;
    struct closed_form_scene scene;
    struct rig_scene rig;
};

/* A fresh key each time would hide stale shadows: the scenes share one. */
static void open_panes(struct fixture *f, void **state, int count, bool has_probes)
{
    f->renderer = *state;
    panes_scene_build(&(struct panes_scene_desc){.pane_count = count,
                                                 .colors = one_color,
                                                 .has_probes = has_probes},
                      &f->scene);
    rig_scene_open(&f->rig, *state, "plan", f->scene.glb, f->scene.size_bytes);
}

static void close_panes(struct fixture *f)
{
    rig_scene_finish(&f->rig, f->renderer);
    closed_form_scene_finish(&f->scene);
}

static struct view floor_view(void)
{
    return (struct view){
        .width_px = 8,
        .height_px = 8,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0.4, 0.5}, .fov_y_deg = 20},
    };
}

static void render(const struct fixture *f, const struct view *view, struct frame_report *report,
                   double middle[3])
{
    struct frame frame;
    shoot(f->renderer, &f->rig, view, &frame);
    const float *p = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], 4, 4);
    for (int c = 0; c < 3; c++)
        middle[c] = p[c];
    *report = frame.report;
    frame_finish(&frame);
}

/* Transmittance at the floor's middle under this view. */
static void transmittance_of(const struct fixture *f, struct view view, double t[3])
{
    struct frame_report report;
    double open[3];
    render(f, &view, &report, t);
    view.quality.shadows = SHADOWS_NONE;
    render(f, &view, &report, open);
    for (int c = 0; c < 3; c++)
        t[c] /= open[c];
}

static void assert_passes(const double t[3], double r, double g, double b)
{
    const double expected[3] = {r, g, b};
    for (int c = 0; c < 3; c++)
        if (!(fabs(t[c] - expected[c]) <= 1e-4))
            fail_msg("channel %d passes %.7g, expected %.7g", c, t[c], expected[c]);
}

static void material_edits_move_the_shadow(void **state)
{
    struct fixture f;
    double t[3];
    open_panes(&f, state, 1, false);
    struct view view = floor_view();
    transmittance_of(&f, view, t);
    assert_passes(t, 0.8, 0.5, 0.25);
    struct view_material_override edit = {
        .material = "Pane", .has_base_color = true, .base_color = {0.25f, 1, 0.5f, 1}};
    view.materials = &edit;
    view.material_override_count = 1;
    transmittance_of(&f, view, t);
    assert_passes(t, 0.25, 1, 0.5);
    edit.has_transmission = true; /* none: the pane is opaque */
    transmittance_of(&f, view, t);
    assert_passes(t, 0, 0, 0);
    edit.transmission = 0.5f;
    transmittance_of(&f, view, t);
    assert_passes(t, 0.125, 0.5, 0.25);
    edit.has_alpha_mode = true;
    edit.alpha_mode = SCENE_BLEND;
    edit.transmission = 0;
    edit.base_color[3] = 0.5f;
    transmittance_of(&f, view, t);
    assert_passes(t, 0.5 * (1 - 0.5 * 0.75), 0.5, 0.5 * (1 - 0.5 * 0.5));
    view.material_override_count = 0;
    transmittance_of(&f, view, t);
    assert_passes(t, 0.8, 0.5, 0.25);
    close_panes(&f);
}

static void node_edits_move_the_shadow(void **state)
{
    struct fixture f;
    double t[3];
    open_panes(&f, state, 1, false);
    struct view view = floor_view();
    struct view_node_override edit = {.node = "Pane", .has_visible = true};
    view.nodes = &edit;
    view.node_override_count = 1;
    transmittance_of(&f, view, t);
    assert_passes(t, 1, 1, 1);
    edit.visible = true;
    transmittance_of(&f, view, t);
    assert_passes(t, 0.8, 0.5, 0.25);
    edit.has_matrix = true; /* beside the light's way to the floor's middle */
    memcpy(edit.matrix, (double[16]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 1, 0, 1},
           sizeof edit.matrix);
    transmittance_of(&f, view, t);
    assert_passes(t, 1, 1, 1);
    edit.matrix[12] = -1; /* and back */
    edit.matrix[14] = 1;
    transmittance_of(&f, view, t);
    assert_passes(t, 0.8, 0.5, 0.25);
    close_panes(&f);
}

static void only_transparent_casters_call_for_deep_maps(void **state)
{
    struct fixture f;
    struct frame_report report;
    double middle[3];
    struct view view = floor_view();
    open_panes(&f, state, 0, true); /* opaque tiles cast */
    render(&f, &view, &report, middle);
    assert_true(report_has_pass(&report, "shadow.", "map"));
    assert_false(report_has_pass(&report, "shadow.", "deep"));
    assert_int_equal(report.counts.shadowed_lights, 1);
    assert_int_equal(report.counts.events, 0);
    close_panes(&f);
    open_panes(&f, state, 1, false);
    render(&f, &view, &report, middle);
    assert_true(report_has_pass(&report, "shadow.", "deep"));
    assert_int_equal(report.counts.longest_list, 1);
    assert_true(report.counts.events > 0);
    assert_true(report.counts.lookups > 0);
    close_panes(&f);
}

static void plain_maps_tell_what_they_let_pass(void **state)
{
    struct fixture f;
    struct frame_report report;
    double middle[3];
    struct view view = floor_view();
    for (int panes = 0; panes < 2; panes++) {
        open_panes(&f, state, panes, true);
        view.quality.shadows = SHADOWS_MAP;
        render(&f, &view, &report, middle);
        assert_int_equal(report.warning_count, panes);
        if (panes)
            assert_string_equal(report.warnings[0],
                                "shadows map: light passes transparent casters unchanged, of 1 of "
                                "1 lights; deep filters it");
        view.quality.shadows = SHADOWS_DEEP;
        render(&f, &view, &report, middle);
        assert_int_equal(report.warning_count, 0);
        close_panes(&f);
    }
}

static void without_lights_there_is_no_shadow_pass(void **state)
{
    struct fixture f;
    struct frame_report report;
    double middle[3];
    open_panes(&f, state, 1, false);
    struct view view = floor_view();
    view.ignore_scene_lights = view.has_environment = true;
    view.sky[0] = view.sky[1] = view.sky[2] = 1;
    render(&f, &view, &report, middle);
    assert_false(report_has_pass(&report, "shadow", NULL));
    assert_false(report_has_pass(&report, "light_list", NULL));
    assert_int_equal(report.counts.lights, 0);
    assert_int_equal(report.counts.lookups, 0);
    /* A horizontal diffuse plane under a uniform sky of 1 nt shows its albedo. */
    for (int c = 0; c < 3; c++)
        assert_true(middle[c] > 0.45 && middle[c] < 0.55);
    struct view_light fill = {.type = SCENE_LIGHT_POINT,
                              .position = {0, 3, 0},
                              .color = {1, 1, 1},
                              .intensity = 10,
                              .casts_no_shadow = true};
    view.lights = &fill;
    view.light_count = 1;
    render(&f, &view, &report, middle);
    assert_false(report_has_pass(&report, "shadow", NULL));
    assert_int_equal(report.counts.shadowed_lights, 0);
    close_panes(&f);
}

static void a_moved_camera_rebuilds_nothing(void **state)
{
    struct fixture f;
    struct frame_report report;
    double middle[3];
    open_panes(&f, state, 1, false);
    for (int technique = SHADOWS_DEEP; technique <= SHADOWS_DEEP_LINKED; technique++) {
        struct view view = floor_view();
        view.quality.shadows = (enum shadow_technique)technique;
        render(&f, &view, &report, middle);
        assert_int_equal(report.counts.shadow_maps_built, 1);
        for (int i = 1; i < 4; i++) {
            view.camera.eye[0] = 0.2 * i;
            view.camera.fov_y_deg = 20 + 10 * i;
            view.width_px = 8 + 4 * i;
            view.background[3] = 0.25f * (float)i;
            render(&f, &view, &report, middle);
            assert_int_equal(report.counts.shadow_maps_built, 0);
            assert_int_equal(report.counts.shadow_maps_reused, 1);
            assert_true(report_has_reused(
                &report, technique == SHADOWS_DEEP ? "shadow.deep" : "shadow.deep-linked"));
        }
    }
    close_panes(&f);
}

static void a_moved_light_rebuilds_its_own_map_only(void **state)
{
    struct fixture f;
    struct frame_report report;
    double middle[3], before[3];
    open_panes(&f, state, 1, false);
    struct view_light lamp = {
        .type = SCENE_LIGHT_POINT, .position = {0, 3, 0}, .color = {1, 1, 1}, .intensity = 10};
    struct view view = floor_view();
    view.lights = &lamp;
    view.light_count = 1;
    render(&f, &view, &report, before);
    lamp.position[0] = 0.1;
    render(&f, &view, &report, middle);
    assert_int_equal(report.counts.shadow_maps_built, 1);
    assert_int_equal(report.counts.shadow_maps_reused, 1);
    lamp.intensity = 20; /* brighter, in the same place */
    render(&f, &view, &report, middle);
    assert_int_equal(report.counts.shadow_maps_built, 0);
    assert_int_equal(report.counts.shadow_maps_reused, 2);
    lamp.position[0] = 0;
    lamp.intensity = 10;
    render(&f, &view, &report, middle);
    for (int c = 0; c < 3; c++)
        assert_true(middle[c] == before[c]);
    close_panes(&f);
}

static void a_light_that_reaches_nothing_in_view_costs_no_shadow(void **state)
{
    struct fixture f;
    struct frame_report report;
    double middle[3], alone[3];
    open_panes(&f, state, 1, false);
    struct view view = floor_view();
    render(&f, &view, &report, alone);
    assert_int_equal(report.counts.unseen_lights, 0);
    struct view_light lamps[2] = {
        {.type = SCENE_LIGHT_POINT, .position = {0, 0.5, 3}, .intensity = 10, .range = 1},
        {.type = SCENE_LIGHT_SPOT,
         .position = {1, 0.5, 0.5},
         .direction = {1, 0, 0},
         .intensity = 10,
         .range = 5,
         .outer_cone_deg = 30},
    };
    for (int i = 0; i < 2; i++)
        lamps[i].color[0] = lamps[i].color[1] = lamps[i].color[2] = 1;
    view.lights = lamps; /* behind the eye; beside the view, shining away */
    view.light_count = 2;
    render(&f, &view, &report, middle);
    assert_int_equal(report.counts.lights, 3);
    assert_int_equal(report.counts.unseen_lights, 2);
    assert_int_equal(report.counts.shadowed_lights, 1);
    assert_int_equal(report.counts.shadow_maps_built, 0);
    for (int c = 0; c < 3; c++)
        assert_true(middle[c] == alone[c]);
    lamps[0].position[1] = 3, lamps[0].position[2] = 0, lamps[0].range = 5; /* into view */
    render(&f, &view, &report, middle);
    assert_int_equal(report.counts.unseen_lights, 1);
    assert_int_equal(report.counts.shadow_maps_built, 1);
    assert_true(middle[1] > alone[1]);
    close_panes(&f);
}

static bool has_reason(const struct frame_report *report, const char *text)
{
    for (int i = 0; i < report->pass_count; i++)
        if (strstr(report->passes[i].because, text))
            return true;
    return false;
}

static void reasons_of_shadow_passes_name_lights_of_every_type(void **state)
{
    static const char *const names[] = {[SCENE_LIGHT_DIRECTIONAL] = "light 0 (directional)",
                                        [SCENE_LIGHT_POINT] = "light 0 (point)",
                                        [SCENE_LIGHT_SPOT] = "light 0 (spot)",
                                        [SCENE_LIGHT_RECT] = "light 0 (rect)",
                                        [SCENE_LIGHT_DISK] = "light 0 (disk)"};
    struct fixture f;
    struct frame_report report;
    double middle[3];
    open_panes(&f, state, 0, true);
    for (int type = 0; type < (int)(sizeof names / sizeof names[0]); type++) {
        struct view_light lamp = {.type = (enum scene_light_type)type,
                                  .position = {0.01 * type, 3, 0}, /* no map is kept for the next */
                                  .direction = {0, -1, 0},
                                  .up = {0, 0, 1},
                                  .color = {1, 1, 1},
                                  .intensity = 10,
                                  .outer_cone_deg = 60,
                                  .width_m = 0.5,
                                  .height_m = 0.5,
                                  .radius_m = 0.25};
        struct view view = floor_view();
        view.ignore_scene_lights = true;
        view.lights = &lamp;
        view.light_count = 1;
        view.quality.shadows = SHADOWS_MAP;
        render(&f, &view, &report, middle);
        if (!has_reason(&report, names[type]))
            fail_msg("no pass is there because of %s", names[type]);
    }
    close_panes(&f);
}

static void a_view_of_nothing_costs_no_shadow(void **state)
{
    struct fixture f;
    struct frame_report report;
    double middle[3];
    open_panes(&f, state, 1, false);
    struct view view = floor_view();
    struct view_light lamps[2] = {
        {.type = SCENE_LIGHT_DIRECTIONAL, .direction = {0, -1, 0}, .intensity = 1},
        {.type = SCENE_LIGHT_POINT, .position = {0, 3, 0}, .intensity = 10}, /* without range */
    };
    for (int i = 0; i < 2; i++)
        lamps[i].color[0] = lamps[i].color[1] = lamps[i].color[2] = 1;
    view.lights = lamps;
    view.light_count = 2;
    view.camera.eye[2] = 500; /* looking away from the floor and the panes */
    view.camera.target[1] = 0.4, view.camera.target[2] = 600;
    render(&f, &view, &report, middle);
    assert_int_equal(report.counts.draws, 0);
    assert_int_equal(report.counts.lights, 3);
    assert_int_equal(report.counts.unseen_lights, 3);
    assert_int_equal(report.counts.shadow_maps_built, 0);
    assert_int_equal(report.counts.shadow_draws, 0);
    close_panes(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(material_edits_move_the_shadow),
        cmocka_unit_test(node_edits_move_the_shadow),
        cmocka_unit_test(only_transparent_casters_call_for_deep_maps),
        cmocka_unit_test(plain_maps_tell_what_they_let_pass),
        cmocka_unit_test(without_lights_there_is_no_shadow_pass),
        cmocka_unit_test(a_moved_camera_rebuilds_nothing),
        cmocka_unit_test(a_moved_light_rebuilds_its_own_map_only),
        cmocka_unit_test(a_light_that_reaches_nothing_in_view_costs_no_shadow),
        cmocka_unit_test(reasons_of_shadow_passes_name_lights_of_every_type),
        cmocka_unit_test(a_view_of_nothing_costs_no_shadow),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

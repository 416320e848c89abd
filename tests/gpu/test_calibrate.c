/* SPDX-License-Identifier: MIT */
/* Measuring a device, and what `auto` makes of it: renderer/frame/calibrate. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/frame/calibrate.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

static void a_device_is_measured_within_its_bound(void **state)
{
    struct renderer *renderer = *state;
    struct calibration calibration;
    struct error err = {0};
    for (int i = 0; i < 2; i++) /* the second compiles nothing */
        if (!renderer_calibrate(renderer, &calibration, &err))
            fail_msg("%s", err.message);
    const struct device_speed *speed = &calibration.speed;
    assert_true(device_speed_is_known(speed));
    assert_true(speed->shade < 1e4 && speed->maps < 1e4 && speed->trace < 1e4 &&
                speed->build < 1e4 && speed->frame_ms > 0);
    assert_int_in_range(calibration.rounds, 1, 1000);
    assert_false(renderer_has_scene(renderer, "calibration"));
}

/* Whatever auto takes is what the request would have got by name, to the bit. */
static void auto_has_the_bits_of_what_it_takes(void **state)
{
    static const double colors[2][4] = {{0.8, 0.5, 0.25, 1}, {0.5, 1, 0.5, 1}};
    static const struct auto_settings settings[] = {
        {.policy = AUTO_RASTER},
        {.policy = AUTO_MEASURED, .speed = {0.01, 0.1, 1e-3, 1, 1}},
        {.policy = AUTO_MEASURED, .speed = {1, 1, 1, 0.01, 0.01}},
        {.policy = AUTO_RAYTRACED},
        {.policy = AUTO_MEASURED, .speed = {0.01, 0.25, 1e3, 1, 1}},
        {.policy = AUTO_MEASURED, .speed = {0.01, 1e-3, 1e-3, 1, 1}},
    };
    static const enum shadow_technique taken[] = {
        SHADOWS_DEEP,
        SHADOWS_DEEP,
        SHADOWS_RAYTRACED,
        SHADOWS_RAYTRACED,
        SHADOWS_RAYTRACED_SHADOWS, /* rays for the shadows alone */
        SHADOWS_AREA,              /* in a frame that would have to build maps */
    };
    struct renderer *renderer = *state;
    struct closed_form_scene panes;
    struct rig_scene rig;
    struct view view = {.width_px = 64, .height_px = 48};
    panes_scene_build(&(struct panes_scene_desc){.pane_count = 2, .colors = colors}, &panes);
    rig_scene_open(&rig, renderer, "panes", panes.glb, panes.size_bytes);
    for (size_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        struct frame frame, named;
        struct plan plan;
        struct error err = {0};
        bool is_traced = taken[i] == SHADOWS_RAYTRACED;
        bool asks_rays = taken[i] == SHADOWS_RAYTRACED_SHADOWS;
        bool has_found_shadows = asks_rays || taken[i] == SHADOWS_AREA; /* without maps */
        renderer_set_auto(renderer, &settings[i]);
        view.quality.shadows = SHADOWS_AUTO;
        shoot(renderer, &rig, &view, &frame);
        struct auto_choice choice;
        const struct view chosen = rig_choose(renderer, rig.key, &view, &choice);
        assert_true(renderer_explain(renderer, rig.key, &chosen, &plan, &err));
        assert_int_equal(plan.requirements[PLAN_NEED_TRACED].is_met, is_traced);
        assert_int_equal(plan.requirements[PLAN_NEED_TRACED_SHADOWS].is_met, has_found_shadows);
        assert_int_equal(report_has_pass(&frame.report, "raytrace.trace", NULL), is_traced);
        assert_int_equal(report_has_pass(&frame.report, "shadow.trace", NULL), asks_rays);
        assert_int_equal(frame.report.chosen.because[0] != 0, i > 0);
        if (i > 0) {
            assert_int_equal(frame.report.chosen.shadows, taken[i]);
            assert_string_equal(plan.requirements[PLAN_NEED_TRACED].because,
                                frame.report.chosen.because);
        }
        view.quality.shadows = taken[i];
        shoot(renderer, &rig, &view, &named);
        assert_false(named.report.chosen.because[0]);
        assert_same_bits(&frame.outputs[VIEW_OUTPUT_COLOR], &named.outputs[VIEW_OUTPUT_COLOR]);
        frame_finish(&frame);
        frame_finish(&named);
    }
    renderer_set_auto(renderer, &settings[0]);
    rig_scene_finish(&rig, renderer);
    closed_form_scene_finish(&panes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_device_is_measured_within_its_bound),
        cmocka_unit_test(auto_has_the_bits_of_what_it_takes),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

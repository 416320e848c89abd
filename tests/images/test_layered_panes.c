/* SPDX-License-Identifier: MIT */
/* Panes over one another by the techniques that keep no lists, against the reference: what is below
 * all panes is right, the panes themselves are right by partitions and by chance, and too dark by
 * one colour of each texel, which is warned of. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

enum { SIDE_PX = 48 };

static const double colors[3][4] = {
    {0.9, 0.3, 0.2, 0.5}, {0.3, 0.8, 0.4, 0.5}, {0.2, 0.4, 0.9, 0.5}};

/* Onto the floor under all panes, or from above onto the panes and the floor behind them. */
static struct view view_from(bool is_above, enum shadow_technique shadows, bool is_reference)
{
    return (struct view){.width_px = SIDE_PX,
                         .height_px = SIDE_PX,
                         .outputs = 1u << VIEW_OUTPUT_COLOR,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {0, is_above ? 3 : 0.9, 0.1},
                                    .target = {0, is_above ? 1 : 0, 0},
                                    .fov_y_deg = is_above ? 20 : 75},
                         .quality = {.shadows = shadows,
                                     .samples = 1,
                                     .shadow_resolution = 2048,
                                     .reference = is_reference}};
}

struct outcome {
    double mean[3];
    bool is_warned; /* of layers */
};

static struct outcome measure_picture(struct renderer *renderer, const struct rig_scene *rig,
                                      const struct view *view)
{
    struct frame frame = {0};
    struct error err = {0};
    struct outcome outcome = {.is_warned = false};
    if (!renderer_render(renderer, rig->key, view, &frame, &err))
        fail_msg("%s", err.message);
    const struct image *color = &frame.outputs[VIEW_OUTPUT_COLOR];
    for (int y = 0; y < SIDE_PX; y++)
        for (int x = 0; x < SIDE_PX; x++)
            for (int k = 0; k < 3; k++)
                outcome.mean[k] += (double)image_pixel_f32(color, x, y)[k] / (SIDE_PX * SIDE_PX);
    for (int i = 0; i < frame.report.warning_count; i++)
        outcome.is_warned |= strstr(frame.report.warnings[i], "behind the last") != NULL;
    frame_finish(&frame);
    return outcome;
}

/* How far the technique's mean is from the reference's, relative: of the channel farthest off. */
static double error_of(const struct outcome *found, const struct outcome *truth)
{
    double farthest = 0;
    for (int k = 0; k < 3; k++) {
        double error = found->mean[k] / truth->mean[k] - 1;
        if (fabs(error) > fabs(farthest))
            farthest = error;
    }
    return farthest;
}

static double measure(struct renderer *renderer, const struct rig_scene *rig, bool is_above,
                      enum shadow_technique shadows, bool *is_warned)
{
    struct view truth_view = view_from(is_above, SHADOWS_RAYTRACED, true);
    struct view view = view_from(is_above, shadows, false);
    struct outcome truth = measure_picture(renderer, rig, &truth_view);
    struct outcome found = measure_picture(renderer, rig, &view);
    double error = error_of(&found, &truth);
    print_message("%s, %s: %.5f\n", shadow_technique_name((int)shadows),
                  is_above ? "from above" : "from below", error);
    *is_warned = found.is_warned;
    return error;
}

static void check_panes(struct renderer *renderer, int count)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    bool is_warned;
    panes_scene_build(
        &(struct panes_scene_desc){
            .pane_count = count, .colors = colors, .is_blend = true, .light = GLB_LIGHT_SPOT},
        &scene);
    rig_scene_open(&rig, renderer, "layered", scene.glb, scene.size_bytes);
    double below = measure(renderer, &rig, false, SHADOWS_TRANSLUCENT, &is_warned);
    double above = measure(renderer, &rig, true, SHADOWS_TRANSLUCENT, &is_warned);
    assert_true(fabs(below) <= 1e-3);
    assert_int_equal(is_warned, count > 1);
    assert_true(count > 1 ? above < -0.05 : fabs(above) <= 1e-3);
    below = measure(renderer, &rig, false, SHADOWS_COMPOSITED, &is_warned);
    above = measure(renderer, &rig, true, SHADOWS_COMPOSITED, &is_warned);
    assert_true(fabs(below) <= 1e-3 && fabs(above) <= 1e-3);
    assert_false(is_warned);
    below = measure(renderer, &rig, false, SHADOWS_COLORED_STOCHASTIC, &is_warned);
    above = measure(renderer, &rig, true, SHADOWS_COLORED_STOCHASTIC, &is_warned);
    /* three deviations: some 90,000 texels, each of which lets a twentieth of the light pass */
    assert_true(fabs(below) <= 0.05 && fabs(above) <= 0.02);
    assert_false(is_warned);
    below = measure(renderer, &rig, false, SHADOWS_MOMENTS, &is_warned);
    above = measure(renderer, &rig, true, SHADOWS_MOMENTS, &is_warned);
    assert_true(fabs(below) <= 1e-3 && fabs(above) <= (count > 1 ? 0.1 : 1e-3));
    rig_scene_finish(&rig, renderer);
    closed_form_scene_finish(&scene);
}

static void one_pane_is_right(void **state)
{
    check_panes(*state, 1);
}

static void several_panes_are_right_where_they_can_be(void **state)
{
    check_panes(*state, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_pane_is_right),
        cmocka_unit_test(several_panes_are_right_where_they_can_be),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

/* SPDX-License-Identifier: MIT */
/* Weighted blending: the closed form of its picture for several layers, no layer lost among many,
 * the warning of what it approximates, and `lists` in its place where it does not go. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"
#include "tests/support/pane_stack.h"

enum { SIDE_PX = 8, MANY_PANES = 64 };

static const struct pane three[] = {
    {.z = 2, .color = {1, 0.25, 0.125}, .alpha = 0.75},
    {.z = 1, .color = {0.125, 1, 0.25}, .alpha = 0.5},
    {.z = -6, .color = {0.25, 0.125, 1}, .alpha = 0.25},
};

static void render(struct renderer *renderer, const struct pane *panes, int count,
                   enum transparency transparency, double haze, struct frame *frame)
{
    const struct pane_shot shot = {
        .transparency = transparency, .side_px = SIDE_PX, .samples = 1, .haze = haze};
    pane_stack_render(renderer, panes, count, &shot, frame);
}

/* Equations 6 and 7 of McGuire and Bavoil 2013, before a wall of 1. */
static double expected(const struct pane *panes, int count, int channel)
{
    double light = 0, opacity = 0, through = 1;
    for (int i = 0; i < count; i++) {
        double z = PANE_STACK_EYE_Z - panes[i].z, alpha = panes[i].alpha;
        double weight =
            fmax(1e-2, fmin(3e3, 10 / (1e-5 + pow(z / 5, 2) + pow(z / 200, 6)))) * alpha;
        light += weight * alpha * panes[i].color[channel];
        opacity += weight * alpha;
        through *= 1 - alpha;
    }
    return light / opacity * (1 - through) + through;
}

static void layers_are_a_mean_by_weights(void **state)
{
    struct frame blended, listed;
    render(*state, three, 3, TRANSPARENCY_WEIGHTED_BLENDED, 0, &blended);
    render(*state, three, 3, TRANSPARENCY_LISTS, 0, &listed);
    const float *b = image_pixel_f32(&blended.outputs[VIEW_OUTPUT_COLOR], 4, 4);
    const float *l = image_pixel_f32(&listed.outputs[VIEW_OUTPUT_COLOR], 4, 4);
    for (int c = 0; c < 3; c++) {
        assert_true(fabs((double)b[c] - expected(three, 3, c)) < 1e-4);
        assert_true(fabs((double)l[c] - pane_stack_exact(three, 3, c)) < 1e-4);
    }
    assert_true(report_has_warning(&blended.report, "transparency weighted-blended averages"));
    assert_false(report_has_warning(&listed.report, "averages"));
    frame_finish(&blended);
    frame_finish(&listed);
}

/* Of one light, every mean is that light: exact for any number of layers, in any order. */
static void no_layer_is_lost_among_many(void **state)
{
    struct pane panes[MANY_PANES];
    struct frame frame;
    for (int i = 0; i < MANY_PANES; i++)
        panes[i] = (struct pane){.z = i * 37 % MANY_PANES * 0.1, .color = {0.5, 0.25, 0.125}};
    for (int i = 0; i < MANY_PANES; i++)
        panes[i].alpha = 1 / 64.0;
    render(*state, panes, MANY_PANES, TRANSPARENCY_WEIGHTED_BLENDED, 0, &frame);
    const float *seen = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], 4, 4);
    for (int c = 0; c < 3; c++)
        assert_true(fabs((double)seen[c] - pane_stack_exact(panes, MANY_PANES, c)) < 1e-4);
    assert_int_equal(frame.report.counts.longest_pixel_list, MANY_PANES);
    frame_finish(&frame);
}

static void expect_lists(struct renderer *renderer, const struct pane *panes, int count,
                         double haze, const char *warning)
{
    struct frame frames[2];
    render(renderer, panes, count, TRANSPARENCY_WEIGHTED_BLENDED, haze, &frames[0]);
    render(renderer, panes, count, TRANSPARENCY_LISTS, haze, &frames[1]);
    assert_true(report_has_warning(&frames[0].report, warning));
    assert_false(report_has_warning(&frames[0].report, "averages"));
    const struct image *a = &frames[0].outputs[VIEW_OUTPUT_COLOR],
                       *b = &frames[1].outputs[VIEW_OUTPUT_COLOR];
    assert_memory_equal(a->pixels, b->pixels, image_size_bytes(a));
    frame_finish(&frames[0]);
    frame_finish(&frames[1]);
}

/* A rough pane of glass scatters what is behind it. */
static void what_refracts_is_drawn_by_lists(void **state)
{
    const struct pane panes[] = {three[0], {.z = 0, .color = {0.5, 0.75, 1}, .transmission = 1}};
    expect_lists(*state, panes, 2, 0,
                 "weighted-blended does not go with refraction: lists takes its place");
}

/* Also where no light shines into it: it dims the layers and what is behind them. */
static void haze_is_drawn_by_lists(void **state)
{
    expect_lists(*state, three, 3, 0.05,
                 "weighted-blended does not go with haze: lists takes its place");
}

/* Of what is transparent, they have the order. */
static void rays_take_its_place_with_a_warning(void **state)
{
    static const char warning[] =
        "transparency weighted-blended does not go with ray traced pictures: rays take its place";
    for (int is_named = 0; is_named < 2; is_named++) {
        struct frame frame;
        const struct pane_shot shot = {.transparency = is_named ? TRANSPARENCY_WEIGHTED_BLENDED
                                                                : TRANSPARENCY_LISTS,
                                       .shadows = SHADOWS_RAYTRACED,
                                       .side_px = SIDE_PX,
                                       .samples = 1};
        pane_stack_render(*state, three, 3, &shot, &frame);
        assert_int_equal(report_has_warning(&frame.report, warning), is_named);
        const float *seen = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], 4, 4);
        for (int c = 0; c < 3; c++)
            assert_true(fabs((double)seen[c] - pane_stack_exact(three, 3, c)) < 1e-4);
        frame_finish(&frame);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_are_a_mean_by_weights),
        cmocka_unit_test(no_layer_is_lost_among_many),
        cmocka_unit_test(what_refracts_is_drawn_by_lists),
        cmocka_unit_test(haze_is_drawn_by_lists),
        cmocka_unit_test(rays_take_its_place_with_a_warning),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

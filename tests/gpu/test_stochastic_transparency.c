/* SPDX-License-Identifier: MIT */
/* Stochastic transparency: as published its mean is the closed form and its variance goes as one
 * over the samples; pixels, samples and layers have chances of their own; corrected it is exact for
 * one layer and for any number of one light, its noise is less, and its mean is near. Noise stands
 * still from frame to frame and over tiles. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"
#include "tests/support/pane_stack.h"

enum { SIDE_PX = 64, PIXELS = SIDE_PX * SIDE_PX, MANY_PANES = 64 };

static const struct pane three[] = {
    {.z = 2, .color = {1, 0.25, 0.125}, .alpha = 0.3},
    {.z = 1, .color = {0.125, 1, 0.25}, .alpha = 0.55},
    {.z = -6, .color = {0.25, 0.125, 1}, .alpha = 0.45},
};
static const struct pane clear_before[] = {
    {.z = 1, .color = {0.75, 0.5, 0.25}, .is_clear = true},
    {.z = -1, .color = {0.125, 0.25, 0.375}, .alpha = 0.6},
};

static struct image shoot_panes(struct renderer *renderer, const struct pane *panes, int count,
                                int samples, bool faithful, struct view_tile tile)
{
    struct frame frame;
    const struct pane_shot shot = {.transparency = TRANSPARENCY_STOCHASTIC,
                                   .side_px = SIDE_PX,
                                   .samples = samples,
                                   .faithful = faithful,
                                   .tile = tile};
    pane_stack_render(renderer, panes, count, &shot, &frame);
    assert_true(report_has_warning(&frame.report, "transparency stochastic leaves it to chance"));
    struct image color = frame.outputs[VIEW_OUTPUT_COLOR];
    frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
    frame_finish(&frame);
    return color;
}

struct spread {
    double mean, variance, beside; /* beside: covariance of pixels side by side */
};

static struct spread spread_of(const struct image *image, int channel)
{
    struct spread s = {0};
    for (int i = 0; i < PIXELS; i++)
        s.mean += (double)image_pixel_f32(image, i % SIDE_PX, i / SIDE_PX)[channel] / PIXELS;
    double before = 0;
    for (int i = 0; i < PIXELS; i++) {
        double d = (double)image_pixel_f32(image, i % SIDE_PX, i / SIDE_PX)[channel] - s.mean;
        s.variance += d * d / PIXELS;
        s.beside += d * before / PIXELS;
        before = d;
    }
    return s;
}

static struct spread measure(struct renderer *renderer, const struct pane *panes, int count,
                             int samples, bool faithful, int channel)
{
    struct image image =
        shoot_panes(renderer, panes, count, samples, faithful, (struct view_tile){0});
    struct spread s = spread_of(&image, channel);
    image_finish(&image);
    return s;
}

static void check_mean(struct renderer *renderer, const struct pane *panes, int count)
{
    struct image image = shoot_panes(renderer, panes, count, 1, true, (struct view_tile){0});
    for (int c = 0; c < 3; c++) {
        struct spread s = spread_of(&image, c);
        double error = sqrt(s.variance / PIXELS);
        assert_true(s.variance > 1e-5);
        if (!(fabs(s.mean - pane_stack_exact(panes, count, c)) < 4 * error))
            fail_msg("channel %d: %g, exact %g, deviation of the mean %g", c, s.mean,
                     pane_stack_exact(panes, count, c), error);
        assert_true(fabs(s.beside) < 5 * s.variance / SIDE_PX);
    }
    image_finish(&image);
}

/* Also where the filter of a layer has a color. Each layer has a chance of its own, or the mean of
 * those behind would be another. */
static void as_published_the_mean_is_exact(void **state)
{
    struct pane equal[4];
    for (int i = 0; i < 4; i++)
        equal[i] = (struct pane){.z = -i, .color = {i & 1, i >> 1, 0.5}, .alpha = 0.45};
    check_mean(*state, three, 3);
    check_mean(*state, clear_before, 2);
    check_mean(*state, equal, 4);
}

static void variance_goes_as_one_over_the_samples(void **state)
{
    static const int samples[] = {1, 4, 8, 16};
    for (int faithful = 0; faithful < 2; faithful++) {
        double alone = measure(*state, three, 3, 1, faithful, 0).variance;
        for (int i = 1; i < 4; i++) {
            double many = measure(*state, three, 3, samples[i], faithful, 0).variance;
            double slope = alone / many / samples[i];
            if (!(slope > 0.85 && slope < 1.15))
                fail_msg("%d samples: variance %g, of one %g", samples[i], many, alone);
        }
    }
}

static void corrected_one_layer_and_one_light_are_exact(void **state)
{
    struct pane panes[MANY_PANES];
    for (int i = 0; i < MANY_PANES; i++)
        panes[i] = (struct pane){
            .z = i * 37 % MANY_PANES * 0.1, .color = {0.5, 0.25, 0.125}, .alpha = 1 / 64.0};
    for (int count = 1; count <= MANY_PANES; count += MANY_PANES - 1) {
        struct image image = shoot_panes(*state, panes, count, 4, false, (struct view_tile){0});
        for (int i = 0; i < 3 * PIXELS; i++) {
            int pixel = i / 3;
            double seen = (double)image_pixel_f32(&image, pixel % SIDE_PX, pixel / SIDE_PX)[i % 3];
            assert_true(fabs(seen - pane_stack_exact(panes, count, i % 3)) < 1e-4);
        }
        image_finish(&image);
    }
}

/* The scale of a sample and its light come from the same parts: their ratio is off by a part of the
 * variance. */
static void correction_takes_noise_away_and_is_near_in_the_mean(void **state)
{
    for (int c = 0; c < 3; c++) {
        struct spread published = measure(*state, three, 3, 1, true, c);
        struct spread corrected = measure(*state, three, 3, 1, false, c);
        double bias = fabs(corrected.mean - pane_stack_exact(three, 3, c));
        print_message("channel %d: variance %g published, %g corrected; bias %g\n", c,
                      published.variance, corrected.variance, bias);
        assert_true(corrected.variance < 0.25 * published.variance);
        assert_true(bias < 0.01);
    }
}

static void noise_stands_still(void **state)
{
    static const struct view_tile tile = {13, 5, 19, 9};
    for (int samples = 1; samples <= 16; samples *= 4) {
        struct image whole = shoot_panes(*state, three, 3, samples, false, (struct view_tile){0});
        struct image again = shoot_panes(*state, three, 3, samples, false, (struct view_tile){0});
        struct image part = shoot_panes(*state, three, 3, samples, false, tile);
        assert_same_bits(&whole, &again);
        for (int y = 0; y < tile.height_px; y++)
            assert_memory_equal(image_pixel_f32(&part, 0, y),
                                image_pixel_f32(&whole, tile.x_px, tile.y_px + y),
                                (size_t)tile.width_px * 4 * sizeof(float));
        image_finish(&whole);
        image_finish(&again);
        image_finish(&part);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(as_published_the_mean_is_exact),
        cmocka_unit_test(variance_goes_as_one_over_the_samples),
        cmocka_unit_test(corrected_one_layer_and_one_light_are_exact),
        cmocka_unit_test(correction_takes_noise_away_and_is_near_in_the_mean),
        cmocka_unit_test(noise_stands_still),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}

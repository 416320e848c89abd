/* SPDX-License-Identifier: MIT */
/* exposure_meter: grey at 0.18, stops for stops, what is left out, highlights, and any numbers. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <string.h>

#include "renderer/image/exposure.h"

enum { SIDE = 40, PIXELS = SIDE * SIDE };

static float pixels[PIXELS][4];

static float meter(void)
{
    const struct image image = {.width_px = SIDE,
                                .height_px = SIDE,
                                .channels = 4,
                                .component = IMAGE_F32,
                                .pixels = pixels};
    return exposure_meter(&image);
}

static void set(int index, float r, float g, float b, float alpha)
{
    memcpy(pixels[index], (float[4]){r, g, b, alpha}, sizeof pixels[index]);
}

/* Grey between low and low * 2^stops, in even steps of logarithms. */
static void fill(double low, double stops)
{
    for (int i = 0; i < PIXELS; i++) {
        float grey = (float)(low * exp2(stops * i / (PIXELS - 1)));
        set(i * 7 % PIXELS, grey, grey, grey, 1);
    }
}

static double near_of(double ev)
{
    return rint(ev * EXPOSURE_STEPS_PER_EV) / EXPOSURE_STEPS_PER_EV;
}

static void grey_comes_to_middle_grey(void **state)
{
    (void)state;
    for (int stop = -14; stop <= 12; stop++) {
        fill(ldexp(0.18, stop), 0);
        assert_true(meter() == (float)-stop);
    }
    /* of a channel alone, its share of the luminance */
    for (int i = 0; i < PIXELS; i++)
        set(i, 0, 1, 0, 1);
    assert_true(meter() == (float)near_of(log2(0.18 / 0.7152)));
}

/* The mean of the stops from a quarter to 19 twentieths is 0.6 of the way. */
static void the_part_between_two_shares_is_metered(void **state)
{
    (void)state;
    fill(0.18 / 32, 5);
    assert_true(fabs((double)meter() - (5 - 0.6 * 5)) <= 0.02);
}

static void stops_of_light_are_stops_of_exposure(void **state)
{
    (void)state;
    fill(0.02, 6);
    float whole = meter();
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < 3; k++)
            pixels[i][k] = ldexpf(pixels[i][k], -5);
    assert_true(meter() == whole + 5);
}

static void background_and_darkness_are_left_out(void **state)
{
    (void)state;
    fill(0.18, 0);
    for (int i = 0; i < PIXELS; i++)
        if (i % 10 < 9)
            set(i, i % 2 ? 1000 : 0, 0, 0, i % 2 ? 0 : 1);
    assert_true(meter() == 0);
    for (int i = 0; i < PIXELS; i++) /* associated: half of a pixel sends half of the light */
        set(i, 0.09f, 0.09f, 0.09f, 0.5f);
    assert_true(meter() == 0);
    fill(0, 0);
    assert_true(meter() == 0);
    for (int i = 0; i < PIXELS; i++)
        set(i, 1, 1, 1, 0);
    assert_true(meter() == 0);
}

/* Above white after the mean: half a stop of it is taken back, of lamps one stop, and of few
 * pixels nothing. */
static void highlights_are_kept_in_bounds(void **state)
{
    (void)state;
    static const struct {
        float lamp;
        int share; /* one of so many pixels */
        double ev;
    } cases[] = {{0.9f, 20, 0}, {1.4142135f, 20, -0.5}, {1000, 20, -1}, {1000, 1000, 0}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        fill(0.18, 0);
        for (int i = 0; i < PIXELS; i += cases[c].share)
            set(i, cases[c].lamp, cases[c].lamp, cases[c].lamp, 1);
        assert_true(fabs((double)meter() - cases[c].ev) <= 1.0 / EXPOSURE_STEPS_PER_EV);
    }
}

/* A pixel that comes or goes moves no more than its share. */
static void it_follows_without_jumps(void **state)
{
    (void)state;
    float last = 0;
    for (int step = 0; step <= 400; step++) {
        fill(0.01 * exp2(step / 100.0), 7);
        float ev = meter();
        if (step > 0)
            assert_true(last - ev >= 0 && last - ev <= 2.5f / EXPOSURE_STEPS_PER_EV);
        last = ev;
    }
}

static void any_numbers_give_an_exposure_within_bounds(void **state)
{
    (void)state;
    const float odd[] = {NAN,    INFINITY, -INFINITY, FLT_MAX, -FLT_MAX, FLT_MIN,
                         1e-45f, -0.0f,    0,         1,       1e30f,    -1};
    enum { ODD = sizeof odd / sizeof *odd };
    for (int c = 0; c < ODD * ODD; c++) {
        for (int i = 0; i < PIXELS; i++)
            set(i, odd[c % ODD], odd[(c + i) % ODD], odd[c % ODD], i % 3 ? odd[c / ODD] : 1);
        float ev = meter();
        assert_true(ev >= -EXPOSURE_MOST_EV && ev <= EXPOSURE_MOST_EV);
    }
    fill(1e30, 0);
    assert_true(meter() == -EXPOSURE_MOST_EV);
    fill(1e-9, 0);
    assert_true(meter() == EXPOSURE_MOST_EV);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grey_comes_to_middle_grey),
        cmocka_unit_test(the_part_between_two_shares_is_metered),
        cmocka_unit_test(stops_of_light_are_stops_of_exposure),
        cmocka_unit_test(background_and_darkness_are_left_out),
        cmocka_unit_test(highlights_are_kept_in_bounds),
        cmocka_unit_test(it_follows_without_jumps),
        cmocka_unit_test(any_numbers_give_an_exposure_within_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

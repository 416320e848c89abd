/* SPDX-License-Identifier: MIT */
/* tone_map: closed forms of the sRGB transfer function and of Khronos PBR Neutral, and tame
 * extremes. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "renderer/image/tone_map.h"

enum { WIDTH = 4096 };

/* Maps a row of pixels. */
static void map_row(const float *in, int width, struct tone_map_desc desc, uint8_t *out)
{
    struct image hdr = {.width_px = width, .height_px = 1, .channels = 4, .component = IMAGE_F32};
    hdr.pixels = (void *)(uintptr_t)in;
    struct image ldr;
    struct error err = {0};
    assert_true(tone_map(&hdr, &desc, &ldr, &err));
    assert_int_equal(ldr.component, IMAGE_U8);
    assert_int_equal(ldr.channels, 4);
    memcpy(out, ldr.pixels, (size_t)width * 4);
    image_finish(&ldr);
}

static void map_one(const float in[4], struct tone_map_desc desc, uint8_t out[4])
{
    map_row(in, 1, desc, out);
}

/* IEC 61966-2-1. */
static double oetf(double x)
{
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

static void srgb_codes_are_correctly_rounded(void **state)
{
    (void)state;
    static float in[WIDTH * 4];
    static uint8_t out[WIDTH * 4];
    for (int round = 0; round < 64; round++) {
        for (int i = 0; i < WIDTH; i++) {
            float x = (float)(round * WIDTH + i) / (64 * WIDTH - 1);
            x = round % 2 ? x : x * x * x; /* dense near black, too */
            memcpy(in + 4 * i, (float[4]){x, x, x, 1}, 16);
        }
        map_row(in, WIDTH, (struct tone_map_desc){.operator_ = TONE_MAPPING_NONE}, out);
        for (int i = 0; i < WIDTH; i++) {
            double exact = 255 * oetf(in[4 * i]);
            assert_true(fabs(out[4 * i] - exact) <= 0.5 + 1e-4);
        }
    }
}

static void eight_bit_srgb_survives_the_round_trip(void **state)
{
    (void)state;
    for (int code = 0; code < 256; code++) {
        double e = code / 255.0;
        float x = (float)(e <= 0.04045 ? e / 12.92 : pow((e + 0.055) / 1.055, 2.4));
        uint8_t out[4];
        map_one((float[4]){x, x, x, 1}, (struct tone_map_desc){.operator_ = TONE_MAPPING_NONE},
                out);
        assert_int_equal(out[0], code);
    }
}

/* The reference implementation of the Khronos PBR Neutral specification, in double. */
static void neutral(double c[3])
{
    const double start = 0.8 - 0.04, desaturation = 0.15, d = 1 - start;
    double x = fmin(c[0], fmin(c[1], c[2])), offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
    for (int i = 0; i < 3; i++)
        c[i] -= offset;
    double peak = fmax(c[0], fmax(c[1], c[2]));
    if (peak < start)
        return;
    double new_peak = 1 - d * d / (peak + d - start);
    double g = 1 - 1 / (desaturation * (peak - new_peak) + 1);
    for (int i = 0; i < 3; i++)
        c[i] = c[i] * new_peak / peak * (1 - g) + new_peak * g;
}

static void neutral_agrees_with_its_specification(void **state)
{
    (void)state;
    srand(7);
    for (int i = 0; i < 20000; i++) {
        float in[4] = {0, 0, 0, 1};
        double c[3];
        for (int k = 0; k < 3; k++) {
            in[k] = (float)exp2(rand() / (double)RAND_MAX * 16 - 10);
            c[k] = in[k];
        }
        uint8_t out[4];
        map_one(in, (struct tone_map_desc){.operator_ = TONE_MAPPING_NEUTRAL}, out);
        neutral(c);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(out[k] - 255 * oetf(fmin(fmax(c[k], 0), 1))) <= 0.51);
    }
}

static void neutral_keeps_base_colours_and_never_falls_on_greys(void **state)
{
    (void)state;
    uint8_t out[4], last = 0;
    /* above the 4 % of Fresnel and below the shoulder, a colour is its value less 0.04 */
    map_one((float[4]){0.54f, 0.24f, 0.14f, 1}, (struct tone_map_desc){.exposure_ev = 0}, out);
    assert_int_equal(out[0], (int)lround(255 * oetf(0.5)));
    assert_int_equal(out[1], (int)lround(255 * oetf(0.2)));
    assert_int_equal(out[2], (int)lround(255 * oetf(0.1)));
    for (int i = 0; i < 10000; i++) {
        float x = (float)exp2(i / 500.0 - 12);
        map_one((float[4]){x, x, x, 1}, (struct tone_map_desc){.exposure_ev = 0}, out);
        assert_true(out[0] >= last && out[0] == out[1] && out[1] == out[2]);
        last = out[0];
    }
    assert_int_equal(last, 255);
}

static void exposure_doubles_per_stop(void **state)
{
    (void)state;
    for (int ev = -8; ev <= 8; ev++) {
        uint8_t shifted[4], plain[4];
        float x = 0.3f, scaled = ldexpf(x, ev);
        map_one((float[4]){x, x / 2, x / 4, 1}, (struct tone_map_desc){.exposure_ev = (float)ev},
                shifted);
        map_one((float[4]){scaled, scaled / 2, scaled / 4, 1},
                (struct tone_map_desc){.exposure_ev = 0}, plain);
        assert_memory_equal(shifted, plain, 4);
    }
}

static void alpha_is_unassociated(void **state)
{
    (void)state;
    struct tone_map_desc none = {.operator_ = TONE_MAPPING_NONE};
    uint8_t half[4], whole[4], clear[4];
    map_one((float[4]){0.1f, 0.2f, 0.25f, 0.5f}, none, half);
    map_one((float[4]){0.2f, 0.4f, 0.5f, 1}, none, whole);
    assert_memory_equal(half, whole, 3);
    assert_int_equal(half[3], 128);
    map_one((float[4]){0.1f, 0.2f, 0.25f, 0}, none, clear);
    assert_memory_equal(clear, ((uint8_t[4]){0, 0, 0, 0}), 4);
    map_one((float[4]){0.2f, 0.4f, 0.5f, 7}, none, clear);
    assert_memory_equal(clear, whole, 4);
}

static void extremes_stay_in_range(void **state)
{
    (void)state;
    const float odd[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX, FLT_MIN, 1e-45f, -0.0f, 0, 1};
    const float stops[] = {0, 100, -100, 1e30f, -1e30f};
    enum { ODD = sizeof odd / sizeof *odd };
    for (int e = 0; e < 5; e++)
        for (int i = 0; i < ODD * ODD; i++)
            for (int operator_ = 0; operator_ < 2; operator_++) {
                float in[4] = {odd[i % ODD], 0.5f, odd[i / ODD], i % 3 ? 1 : odd[i / ODD]};
                uint8_t out[4];
                map_one(in, (struct tone_map_desc){operator_, stops[e]}, out);
                if (!isfinite(in[0]) && isfinite(in[3]) && in[3] == 1 && operator_)
                    assert_int_equal(out[0], 0);
            }
    uint8_t out[4];
    map_one((float[4]){FLT_MAX, FLT_MAX, FLT_MAX, 1}, (struct tone_map_desc){.exposure_ev = 10},
            out);
    assert_memory_equal(out, ((uint8_t[4]){255, 255, 255, 255}), 4);
    struct image ldr, wrong = {.width_px = 1, .height_px = 1, .channels = 3};
    struct error err = {0};
    assert_false(tone_map(&wrong, &(struct tone_map_desc){.exposure_ev = 0}, &ldr, &err));
    assert_int_equal(err.code, ERROR_INTERNAL);
}

/* Its own values where nothing is before it and where layers only filter it; the mapped radiance
 * where nothing of it is seen; and it never gets darker by light. */
static void a_backdrop_is_a_colour_of_the_screen(void **state)
{
    (void)state;
    const float backdrop[4] = {0.012f, 1, 0.5f, 1};
    for (int i = 0; i < 64; i++) {
        const struct tone_map_desc desc = {.operator_ = (enum tone_mapping)(i % 2),
                                           .exposure_ev = (float)(i / 2 % 4) - 2};
        float shown[4], brighter[4], mapped[3] = {0.3f, 4, 0.01f};
        struct tone_map_over pixel = {.covered = 0};
        tone_map_over(&desc, backdrop, &pixel, shown);
        assert_memory_equal(shown, backdrop, sizeof backdrop);
        pixel = (struct tone_map_over){.behind = {1, 0.5f, 0.25f}, .covered = 1};
        tone_map_over(&desc, backdrop, &pixel, shown);
        for (int k = 0; k < 3; k++)
            assert_true(shown[k] == backdrop[k] * pixel.behind[k]);
        for (int k = 0; k < 3; k++)
            pixel.radiance[k] = 0.05f * (float)(i / 8);
        tone_map_over(&desc, backdrop, &pixel, brighter);
        for (int k = 0; k < 3; k++)
            assert_true(brighter[k] >= shown[k]);
        pixel = (struct tone_map_over){.covered = 1};
        memcpy(pixel.radiance, mapped, sizeof mapped);
        tone_map_over(&desc, backdrop, &pixel, shown);
        tone_map_color(&desc, mapped);
        assert_memory_equal(shown, mapped, sizeof mapped);
        assert_true(shown[3] == 1);
    }
}

static void a_backdrop_survives_extremes(void **state)
{
    (void)state;
    const float backdrop[4] = {1, 0, 0.5f, 1}, values[] = {NAN, INFINITY, -INFINITY, -1, FLT_MAX};
    for (int i = 0; i < 5; i++) {
        struct tone_map_over pixel = {.behind = {0.1f, 0.1f, 0.1f}, .covered = 1 / 256.0f};
        float shown[4];
        for (int k = 0; k < 3; k++)
            pixel.radiance[k] = values[i];
        tone_map_over(&(struct tone_map_desc){.exposure_ev = 10}, backdrop, &pixel, shown);
        for (int k = 0; k < 4; k++)
            assert_true(isfinite(shown[k]) && shown[k] >= 0);
    }
}

static void a_frame_of_720p_is_mapped_within_a_frame_time(void **state)
{
    (void)state;
    struct image hdr, ldr;
    struct error err = {0};
    assert_true(image_init(&hdr, 1280, 720, 4, IMAGE_F32, &err));
    float *pixels = hdr.pixels;
    for (size_t i = 0; i < 1280 * 720 * 4; i++)
        pixels[i] = i % 4 == 3 ? 1 : (float)(i * 2654435761u % 4096) / 2048;
    double best_ms = 1e9;
    for (int round = 0; round < 5; round++) {
        struct timespec a, b;
        clock_gettime(CLOCK_MONOTONIC, &a);
        assert_true(tone_map(&hdr, &(struct tone_map_desc){.exposure_ev = 0}, &ldr, &err));
        clock_gettime(CLOCK_MONOTONIC, &b);
        double ms = (double)(b.tv_sec - a.tv_sec) * 1e3 + (double)(b.tv_nsec - a.tv_nsec) / 1e6;
        best_ms = fmin(best_ms, ms);
        image_finish(&ldr);
    }
    image_finish(&hdr);
    fprintf(stderr, "tone map, 1280 x 720: %.1f ms\n", best_ms);
    assert_true(best_ms < 500); /* slack for sanitizers; about 10 ms in a release build */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(srgb_codes_are_correctly_rounded),
        cmocka_unit_test(eight_bit_srgb_survives_the_round_trip),
        cmocka_unit_test(neutral_agrees_with_its_specification),
        cmocka_unit_test(neutral_keeps_base_colours_and_never_falls_on_greys),
        cmocka_unit_test(exposure_doubles_per_stop),
        cmocka_unit_test(alpha_is_unassociated),
        cmocka_unit_test(extremes_stay_in_range),
        cmocka_unit_test(a_backdrop_is_a_colour_of_the_screen),
        cmocka_unit_test(a_backdrop_survives_extremes),
        cmocka_unit_test(a_frame_of_720p_is_mapped_within_a_frame_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* tone_map: closed forms of the sRGB transfer function and of the tone mappings, and tame
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

enum { WIDTH = 4096, OPERATORS = TONE_MAPPING_ACES + 1 };

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

/* m: by rows. */
static void multiply(const double m[9], double c[3])
{
    const double in[3] = {c[0], c[1], c[2]};
    for (int i = 0; i < 3; i++)
        c[i] = m[3 * i] * in[0] + m[3 * i + 1] * in[1] + m[3 * i + 2] * in[2];
}

/* Wrensch 2023, "Minimal AgX Implementation", in double: agxDefaultContrastApprox, agx, agxEotf. */
static void agx(double c[3])
{
    static const double inset[9] = {
        0.842479062253094,  0.0784335999999992, 0.0792237451477643,
        0.0423282422610123, 0.878468636469772,  0.0791661274605434,
        0.0423756549057051, 0.0784336,          0.879142973793104,
    };
    static const double outset[9] = {
        1.19687900512017,    -0.0980208811401368, -0.0990297440797205,
        -0.0528968517574562, 1.15190312990417,    -0.0989611768448433,
        -0.0529716355144438, -0.0980434501171241, 1.15107367264116,
    };
    const double least_ev = -12.47393, most_ev = 4.026069;
    multiply(inset, c);
    for (int i = 0; i < 3; i++) {
        double x = (fmin(fmax(log2(c[i]), least_ev), most_ev) - least_ev) / (most_ev - least_ev);
        c[i] = 15.5 * pow(x, 6) - 40.14 * pow(x, 5) + 31.96 * pow(x, 4) - 6.868 * pow(x, 3) +
               0.4298 * x * x + 0.1191 * x - 0.00232;
    }
    multiply(outset, c);
    for (int i = 0; i < 3; i++)
        c[i] = pow(fmax(c[i], 0), 2.2);
}

/* Hill 2016, ACES.hlsl of BakingLab: RRTAndODTFit and ACESFitted, in double. */
static void aces(double c[3])
{
    static const double in[9] = {0.59719, 0.35458, 0.04823, 0.07600, 0.90834,
                                 0.01566, 0.02840, 0.13383, 0.83777};
    static const double out[9] = {1.60475,  -0.53108, -0.07367, -0.10208, 1.10813,
                                  -0.00605, -0.00327, -0.07276, 1.07602};
    multiply(in, c);
    for (int i = 0; i < 3; i++)
        c[i] = (c[i] * (c[i] + 0.0245786) - 0.000090537) /
               (c[i] * (0.983729 * c[i] + 0.4329510) + 0.238081);
    multiply(out, c);
}

static void curves_agree_with_their_sources(void **state)
{
    (void)state;
    static const struct {
        enum tone_mapping operator_;
        void (*map)(double c[3]);
    } curves[] = {{TONE_MAPPING_AGX, agx}, {TONE_MAPPING_ACES, aces}};
    srand(11);
    for (int i = 0; i < 40000; i++) {
        float in[4] = {0, 0, 0, 1}, linear[3];
        double c[3];
        for (int k = 0; k < 3; k++)
            c[k] = linear[k] = in[k] = (float)exp2(rand() / (double)RAND_MAX * 24 - 16);
        const struct tone_map_desc desc = {.operator_ = curves[i % 2].operator_};
        uint8_t out[4];
        map_one(in, desc, out);
        tone_map_color(&desc, linear);
        curves[i % 2].map(c);
        for (int k = 0; k < 3; k++) {
            double expected = fmin(fmax(c[k], 0), 1);
            if (fabs(linear[k] - expected) > 2e-5)
                fail_msg("%g for %g", linear[k], expected);
            assert_true(fabs(out[k] - 255 * oetf(expected)) <= 0.51);
        }
    }
}

/* Of greys, at which the matrices are 1: AgX is its polynomial, of 10 / 16.5 at 0.18, and 1 less
 * 0.0014 at the end; ACES is its fraction, whose limit is 1 / 0.983729. */
static void curves_have_their_values_at_grey_and_white(void **state)
{
    (void)state;
    static const struct {
        enum tone_mapping operator_;
        float in, out, tolerance;
    } points[] = {
        {TONE_MAPPING_AGX, 0.18f, 0.2145f, 0.0005f},
        {TONE_MAPPING_AGX, 1, 0.5902f, 0.0005f},
        {TONE_MAPPING_AGX, 0, 0, 0},
        {TONE_MAPPING_AGX, 1e30f, 0.9969f, 0.0005f},
        {TONE_MAPPING_ACES, 0.18f, 0.1056f, 0.0003f},
        {TONE_MAPPING_ACES, 1, 0.6191f, 0.0003f},
        {TONE_MAPPING_ACES, 0, 0, 0},
        {TONE_MAPPING_ACES, 1e30f, 1, 0},
    };
    for (size_t i = 0; i < sizeof points / sizeof *points; i++) {
        float grey[3] = {points[i].in, points[i].in, points[i].in};
        tone_map_color(&(struct tone_map_desc){.operator_ = points[i].operator_}, grey);
        for (int k = 0; k < 3; k++)
            if (fabsf(grey[k] - points[i].out) > points[i].tolerance)
                fail_msg("operator %d maps %g to %.6f", points[i].operator_, points[i].in, grey[k]);
    }
}

/* Never darker, and never coloured by more than a code. */
static void greys_stay_grey_and_in_order(void **state)
{
    (void)state;
    for (int operator_ = 0; operator_ < OPERATORS; operator_++) {
        uint8_t out[4], last[4] = {0};
        for (int i = 0; i < 60000; i++) {
            float x = (float)exp2(i / 500.0 - 20);
            map_one((float[4]){x, x, x, 1},
                    (struct tone_map_desc){.operator_ = (enum tone_mapping)operator_}, out);
            for (int k = 0; k < 3; k++)
                assert_true(out[k] >= last[k] && abs(out[k] - out[0]) <= 1);
            memcpy(last, out, sizeof last);
        }
        assert_int_equal(last[0], 255);
    }
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
            for (int operator_ = 0; operator_ < OPERATORS; operator_++) {
                float in[4] = {odd[i % ODD], 0.5f, odd[i / ODD], i % 3 ? 1 : odd[i / ODD]};
                uint8_t out[4];
                map_one(in, (struct tone_map_desc){operator_, stops[e]}, out);
                if (!isfinite(in[0]) && isfinite(in[3]) && in[3] == 1 &&
                    operator_ == TONE_MAPPING_NONE)
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
/* Odd values change nothing in the pixels beside them, and a pixel has the same code wherever it
 * is. */
static void pixels_do_not_depend_on_their_neighbours(void **state)
{
    (void)state;
    static const float odd[] = {NAN,   INFINITY, -INFINITY, -1,       -0.0f, 0, FLT_MIN, 1e-42f,
                                1e-5f, 0.08f,    0.76f,     0.99999f, 1,     2, 65504,   FLT_MAX};
    enum { ODD = sizeof odd / sizeof *odd, COUNT = 64 + 37 };
    static float in[COUNT * 4];
    uint8_t whole[COUNT * 4], alone[4];
    srand(11);
    for (int operator_ = 0; operator_ < OPERATORS; operator_++)
        for (int round = 0; round < 20; round++) {
            struct tone_map_desc desc = {.operator_ = (enum tone_mapping)operator_,
                                         .exposure_ev = (float)(round % 5 - 2)};
            for (int i = 0; i < COUNT * 4; i++)
                in[i] = rand() % 3 ? (float)rand() / (float)RAND_MAX : odd[rand() % ODD];
            map_row(in, COUNT, desc, whole);
            for (int i = 0; i < COUNT; i++) {
                map_one(in + 4 * i, desc, alone);
                assert_memory_equal(whole + 4 * i, alone, 4);
            }
        }
}

static void a_backdrop_is_a_colour_of_the_screen(void **state)
{
    (void)state;
    const float backdrop[4] = {0.012f, 1, 0.5f, 1};
    for (int i = 0; i < 128; i++) {
        const struct tone_map_desc desc = {.operator_ = (enum tone_mapping)(i % OPERATORS),
                                           .exposure_ev = (float)(i / OPERATORS % 4) - 2};
        float shown[4], brighter[4], mapped[3] = {0.3f, 4, 0.01f};
        struct tone_map_over pixel = {.covered = 0};
        tone_map_over(&desc, backdrop, &pixel, shown);
        assert_memory_equal(shown, backdrop, sizeof backdrop);
        pixel = (struct tone_map_over){.behind = {1, 0.5f, 0.25f}, .covered = 1};
        tone_map_over(&desc, backdrop, &pixel, shown);
        for (int k = 0; k < 3; k++)
            assert_true(shown[k] == backdrop[k] * pixel.behind[k]);
        for (int k = 0; k < 3; k++)
            pixel.radiance[k] = 0.05f * (float)(i / 16);
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
        cmocka_unit_test(curves_agree_with_their_sources),
        cmocka_unit_test(curves_have_their_values_at_grey_and_white),
        cmocka_unit_test(greys_stay_grey_and_in_order),
        cmocka_unit_test(exposure_doubles_per_stop),
        cmocka_unit_test(alpha_is_unassociated),
        cmocka_unit_test(extremes_stay_in_range),
        cmocka_unit_test(pixels_do_not_depend_on_their_neighbours),
        cmocka_unit_test(a_backdrop_is_a_colour_of_the_screen),
        cmocka_unit_test(a_backdrop_survives_extremes),
        cmocka_unit_test(a_frame_of_720p_is_mapped_within_a_frame_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

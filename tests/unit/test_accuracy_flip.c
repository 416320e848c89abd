/* SPDX-License-Identifier: MIT */
/* FLIP: identity, closed forms of plain colours, the values of the authors' own implementation, and
 * tame extremes. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "renderer/accuracy/flip.h"

enum { WIDTH = 60, HEIGHT = 40 };

static struct image image_of(int width_px, int height_px, int channels)
{
    struct image image;
    struct error err = {0};
    assert_true(image_init(&image, width_px, height_px, channels, IMAGE_F32, &err));
    return image;
}

static float *at(const struct image *image, int x, int y)
{
    return (float *)image->pixels + (size_t)(y * image->width_px + x) * (size_t)image->channels;
}

static void fill(const struct image *image, const float *color)
{
    for (int y = 0; y < image->height_px; y++)
        for (int x = 0; x < image->width_px; x++)
            memcpy(at(image, x, y), color, (size_t)image->channels * sizeof *color);
}

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g is not %.9g +- %g", value, expected, tolerance);
}

static struct flip measure(const struct flip_desc *desc, struct image *map)
{
    struct flip flip;
    struct error err = {0};
    if (!flip_measure(desc, &flip, map, &err))
        fail_msg("%s", err.message);
    return flip;
}

/* A busy picture, and the same with three quarters of the light in the fields of a chessboard. */
static void fill_pattern(const struct image *image, const struct image *reference, bool is_hdr)
{
    for (int y = 0; y < image->height_px; y++)
        for (int x = 0; x < image->width_px; x++)
            for (int c = 0; c < 3; c++) {
                float value = (float)((x * 3 + y * 5 + c * 11) % 29) / 28;
                if (is_hdr)
                    value = value * value * value * value * 40 + 0.001f;
                at(reference, x, y)[c] = value;
                at(image, x, y)[c] = (x / 8 + y / 8) % 2 ? value * 0.75f : value;
            }
}

struct known {
    bool is_hdr;
    double pixels_per_degree, mean, middle, corner, p99;
};

/* From the implementation that the authors publish (FLIP.h of September 2025, on the CPU) on
 * the very same pixels. Its sums are in f32 and its constants rounded to 9 digits. */
static void values_are_those_of_the_authors(void **state)
{
    (void)state;
    static const struct known known[] = {
        {false, 0, 0.242230996, 0.355603516, 0.414084882, 0.424542218},
        {false, 24, 0.250428717, 0.482171446, 0.447455168, 0.526387990},
        {true, 0, 0.141118941, 0.180265635, 0.253814310, 0.272157609},
    };
    struct image image = image_of(WIDTH, HEIGHT, 3), reference = image_of(WIDTH, HEIGHT, 3);
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        struct image map;
        fill_pattern(&image, &reference, known[i].is_hdr);
        struct flip flip =
            measure(&(struct flip_desc){.image = &image,
                                        .reference = &reference,
                                        .pixels_per_degree = known[i].pixels_per_degree,
                                        .is_hdr = known[i].is_hdr},
                    &map);
        assert_near(flip.mean, known[i].mean, 5e-6);
        assert_near(flip.p99, known[i].p99, 2e-5);
        assert_near((double)at(&map, 30, 20)[0], known[i].middle, 2e-5);
        assert_near((double)at(&map, 59, 39)[0], known[i].corner, 2e-5);
        assert_near((double)at(&map, flip.max_x, flip.max_y)[0], flip.max, 0);
        image_finish(&map);
    }
    image_finish(&image);
    image_finish(&reference);
}

static void exposures_reach_from_the_brightest_pixel_to_the_median(void **state)
{
    (void)state;
    struct image image = image_of(32, 32, 3), reference = image_of(32, 32, 3);
    fill(&reference, (const float[]){1, 1, 1});
    at(&reference, 3, 3)[0] = at(&reference, 3, 3)[1] = at(&reference, 3, 3)[2] = 1024;
    struct flip_desc desc = {.image = &image, .reference = &reference, .is_hdr = true};
    struct flip flip = measure(&desc, NULL);
    assert_near(flip.last_exposure_ev - flip.first_exposure_ev, 10, 1e-5);
    assert_int_equal(flip.exposures, 10);
    /* median white is mapped to 0.85 at the last one */
    double x = exp2(flip.last_exposure_ev) * 0.6;
    assert_near(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.85, 1e-6);
    fill(&reference, (const float[]){5, 5, 5});
    flip = measure(&desc, NULL);
    assert_int_equal(flip.exposures, 2);
    image_finish(&image);
    image_finish(&reference);
}

static void an_image_does_not_flicker_against_itself(void **state)
{
    (void)state;
    struct image image = image_of(WIDTH, HEIGHT, 3), reference = image_of(WIDTH, HEIGHT, 3);
    for (int hdr = 0; hdr < 2; hdr++) {
        struct image map;
        fill_pattern(&image, &reference, hdr);
        struct flip flip = measure(
            &(struct flip_desc){.image = &reference, .reference = &reference, .is_hdr = hdr}, &map);
        assert_true(flip.mean == 0 && flip.p99 == 0 && flip.max == 0);
        assert_int_equal(map.channels, 1);
        assert_true(at(&map, 17, 23)[0] == 0);
        assert_near(flip.pixels_per_degree, 67.02, 0.01);
        image_finish(&map);
    }
    image_finish(&image);
    image_finish(&reference);
}

/* CIELab of a linear Rec.709 colour with the Hunt effect, in f64, from CIE 15 and IEC 61966-2-1. */
static void hunt_lab(const float rgb[3], double lab[3])
{
    static const double m[3][3] = {{0.4123907993, 0.3575843394, 0.1804807884},
                                   {0.2126390059, 0.7151686788, 0.0721923154},
                                   {0.0193308187, 0.1191947798, 0.9505321522}};
    double f[3];
    for (int i = 0; i < 3; i++) {
        double white = m[i][0] + m[i][1] + m[i][2];
        double t = (m[i][0] * rgb[0] + m[i][1] * rgb[1] + m[i][2] * rgb[2]) / white;
        f[i] = t > 216. / 24389 ? cbrt(t) : (24389. / 27 * t + 16) / 116;
    }
    lab[0] = 116 * f[1] - 16;
    lab[1] = 0.01 * lab[0] * 500 * (f[0] - f[1]);
    lab[2] = 0.01 * lab[0] * 200 * (f[1] - f[2]);
}

static double hyab(const float a[3], const float b[3])
{
    double p[3], q[3];
    hunt_lab(a, p);
    hunt_lab(b, q);
    return fabs(p[0] - q[0]) + hypot(p[1] - q[1], p[2] - q[2]);
}

/* Without any edge FLIP is the compressed distance of the two colours, at every pixel. */
static double plain_flip(const float a[3], const float b[3])
{
    double largest = pow(hyab((const float[]){0, 1, 0}, (const float[]){0, 0, 1}), 0.7);
    double distance = pow(hyab(a, b), 0.7), knee = 0.4 * largest;
    return distance < knee ? 0.95 * distance / knee
                           : 0.95 + 0.05 * (distance - knee) / (largest - knee);
}

static void plain_colours_have_their_closed_form(void **state)
{
    (void)state;
    static const float colors[][2][3] = {
        {{0, 0, 0}, {1, 1, 1}},
        {{0, 1, 0}, {0, 0, 1}},
        {{0.5f, 0.5f, 0.5f}, {0.55f, 0.5f, 0.5f}},
        {{0.2f, 0.2f, 0.2f}, {0.201f, 0.2f, 0.2f}},
        {{1, 0, 0}, {1, 0.1f, 0}},
        {{0.001f, 0, 0}, {0, 0, 0.002f}},
    };
    struct image image = image_of(40, 30, 3), reference = image_of(40, 30, 3);
    for (size_t i = 0; i < sizeof colors / sizeof *colors; i++) {
        fill(&image, colors[i][0]);
        fill(&reference, colors[i][1]);
        struct flip_desc desc = {.image = &image, .reference = &reference};
        struct flip flip = measure(&desc, NULL);
        double expected = plain_flip(colors[i][0], colors[i][1]);
        assert_near(flip.mean, expected, 5e-5);
        assert_near(flip.max, expected, 5e-5);
        assert_near(flip.p99, expected, 5e-5);
        /* and the order of the two does not matter */
        struct flip_desc swapped = {.image = &reference, .reference = &image};
        assert_true(measure(&swapped, NULL).mean == flip.mean);
    }
    image_finish(&image);
    image_finish(&reference);
}

static void from_further_away_fine_noise_is_seen_less(void **state)
{
    (void)state;
    struct image image = image_of(64, 64, 3), reference = image_of(64, 64, 3);
    fill(&reference, (const float[]){0.5f, 0.5f, 0.5f});
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++)
            for (int c = 0; c < 3; c++)
                at(&image, x, y)[c] = (x + y) % 2 ? 0.4f : 0.6f;
    double near =
        measure(
            &(struct flip_desc){.image = &image, .reference = &reference, .pixels_per_degree = 8},
            NULL)
            .mean;
    double far =
        measure(
            &(struct flip_desc){.image = &image, .reference = &reference, .pixels_per_degree = 120},
            NULL)
            .mean;
    assert_true(near > 0.2);
    assert_true(far < 0.05 * near);
    image_finish(&image);
    image_finish(&reference);
}

static void tiles_leave_no_seam(void **state)
{
    (void)state;
    /* wider and higher than a tile: the same pixels in the middle of an image and at a tile's
     * border
     */
    struct image image = image_of(300, 150, 3), reference = image_of(300, 150, 3);
    struct image part = image_of(200, 120, 3), part_reference = image_of(200, 120, 3);
    fill_pattern(&image, &reference, false);
    for (int y = 0; y < 120; y++) {
        memcpy(at(&part, 0, y), at(&image, 80, y + 20), 200 * 3 * sizeof(float));
        memcpy(at(&part_reference, 0, y), at(&reference, 80, y + 20), 200 * 3 * sizeof(float));
    }
    struct image map, part_map;
    measure(&(struct flip_desc){.image = &image, .reference = &reference}, &map);
    measure(&(struct flip_desc){.image = &part, .reference = &part_reference}, &part_map);
    for (int y = 10; y < 110; y++) /* filters reach 10 pixels */
        for (int x = 10; x < 190; x++)
            assert_true(at(&part_map, x, y)[0] == at(&map, x + 80, y + 20)[0]);
    image_finish(&image);
    image_finish(&reference);
    image_finish(&part);
    image_finish(&part_reference);
    image_finish(&map);
    image_finish(&part_map);
}

static void grey_and_alpha_are_read_as_they_are_meant(void **state)
{
    (void)state;
    struct image grey = image_of(20, 20, 1), grey_reference = image_of(20, 20, 1);
    struct image rgba = image_of(20, 20, 4), rgba_reference = image_of(20, 20, 4);
    fill(&grey, (const float[]){0.3f});
    fill(&grey_reference, (const float[]){0.4f});
    fill(&rgba, (const float[]){0.3f, 0.3f, 0.3f, 0.1f});
    fill(&rgba_reference, (const float[]){0.4f, 0.4f, 0.4f, 0.9f});
    struct flip one =
        measure(&(struct flip_desc){.image = &grey, .reference = &grey_reference}, NULL);
    struct flip four =
        measure(&(struct flip_desc){.image = &rgba, .reference = &rgba_reference}, NULL);
    assert_true(one.mean > 0.05 && one.mean == four.mean);
    image_finish(&grey);
    image_finish(&grey_reference);
    image_finish(&rgba);
    image_finish(&rgba_reference);
}

static void nan_and_infinity_are_told_and_do_not_spread(void **state)
{
    (void)state;
    struct image image = image_of(50, 50, 3), reference = image_of(50, 50, 3), map;
    for (int hdr = 0; hdr < 2; hdr++) {
        fill(&image, (const float[]){0.2f, 0.3f, 0.4f});
        fill(&reference, (const float[]){0.2f, 0.3f, 0.4f});
        at(&image, 25, 25)[1] = NAN;
        at(&reference, 0, 0)[2] = -INFINITY;
        struct flip flip = measure(
            &(struct flip_desc){.image = &image, .reference = &reference, .is_hdr = hdr}, &map);
        assert_int_equal(flip.nonfinite_pixels, 2);
        assert_true(at(&map, 25, 25)[0] == 1 && at(&map, 0, 0)[0] == 1);
        assert_true(at(&map, 25, 40)[0] == 0);
        assert_true(flip.max < 1 && isfinite(flip.mean));
        image_finish(&map);
    }
    image_finish(&image);
    image_finish(&reference);
}

static void extremes_give_numbers_between_0_and_1(void **state)
{
    (void)state;
    static const float values[] = {0, -5, FLT_MAX, -FLT_MAX, FLT_TRUE_MIN, 1e-30f, 1e30f};
    enum { COUNT = sizeof values / sizeof *values };
    static const int sizes[][2] = {{1, 1}, {1, 70}, {300, 1}, {5, 5}};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (int i = 0; i < COUNT * COUNT * 2; i++) {
            struct image image = image_of(sizes[s][0], sizes[s][1], 3), map;
            struct image reference = image_of(sizes[s][0], sizes[s][1], 3);
            float a = values[i % COUNT], b = values[i / COUNT % COUNT];
            fill(&image, (const float[]){a, a, b});
            fill(&reference, (const float[]){b, a, a});
            at(&reference, 0, 0)[0] = 1;
            struct flip flip = measure(&(struct flip_desc){.image = &image,
                                                           .reference = &reference,
                                                           .is_hdr = i >= COUNT * COUNT},
                                       &map);
            assert_true(flip.mean >= 0 && flip.max <= 1 && flip.p99 <= flip.max);
            assert_true(flip.exposures <= FLIP_EXPOSURES_MAX);
            for (int y = 0; y < map.height_px; y++)
                for (int x = 0; x < map.width_px; x++)
                    assert_true(at(&map, x, y)[0] >= 0 && at(&map, x, y)[0] <= 1);
            image_finish(&image);
            image_finish(&reference);
            image_finish(&map);
        }
}

static void darkness_has_exposures_too(void **state)
{
    (void)state;
    struct image image = image_of(16, 16, 3), black = image_of(16, 16, 3);
    fill(&image, (const float[]){1, 1, 1});
    /* no light in the reference: those of the image, in which it is seen */
    struct flip flip =
        measure(&(struct flip_desc){.image = &image, .reference = &black, .is_hdr = true}, NULL);
    assert_true(flip.mean > 0.9 && isfinite(flip.first_exposure_ev));
    flip = measure(&(struct flip_desc){.image = &black, .reference = &black, .is_hdr = true}, NULL);
    assert_true(flip.mean == 0);
    /* mostly black: the median of what is lit */
    at(&black, 2, 2)[1] = 4;
    at(&black, 3, 2)[1] = 1;
    at(&black, 4, 2)[1] = 1;
    flip = measure(&(struct flip_desc){.image = &image, .reference = &black, .is_hdr = true}, NULL);
    assert_near(flip.last_exposure_ev - flip.first_exposure_ev, 2, 1e-6);
    image_finish(&image);
    image_finish(&black);
}

static void what_cannot_be_compared_is_refused(void **state)
{
    (void)state;
    struct image image = image_of(8, 4, 3), other = image_of(4, 8, 3), map;
    struct flip flip;
    struct error err = {0};
    assert_false(
        flip_measure(&(struct flip_desc){.image = &image, .reference = &other}, &flip, &map, &err));
    assert_string_equal(err.message, "the image is 8 x 4 pixels, the reference 4 x 8");
    assert_null(map.pixels);
    static const double bad[] = {0.5, -1, 1001, NAN, INFINITY};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct flip_desc desc = {.image = &image, .reference = &image, .pixels_per_degree = bad[i]};
        err = (struct error){0};
        assert_false(flip_measure(&desc, &flip, NULL, &err));
        assert_int_equal(err.code, ERROR_INVALID_REQUEST);
        assert_non_null(strstr(err.message, "must be from 1 to 1000"));
    }
    image_finish(&image);
    image_finish(&other);
}

static double processor_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Cost per pixel does not grow with the image, and is fit for a measurement of many variants. */
static void speed_is_that_of_a_separable_filter(void **state)
{
    (void)state;
    struct image image = image_of(512, 512, 3), reference = image_of(512, 512, 3);
    fill_pattern(&image, &reference, false);
    struct flip_desc desc = {.image = &image, .reference = &reference};
    double best = INFINITY;
    for (int i = 0; i < 3; i++) {
        double start = processor_s();
        measure(&desc, NULL);
        best = fmin(best, processor_s() - start);
    }
    printf("FLIP: %.1f MP/s\n", 512 * 512 * 1e-6 / best);
    assert_true(best < 2); /* 0.13 MP/s: thirty times slower than measured */
    image_finish(&image);
    image_finish(&reference);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_those_of_the_authors),
        cmocka_unit_test(exposures_reach_from_the_brightest_pixel_to_the_median),
        cmocka_unit_test(an_image_does_not_flicker_against_itself),
        cmocka_unit_test(plain_colours_have_their_closed_form),
        cmocka_unit_test(from_further_away_fine_noise_is_seen_less),
        cmocka_unit_test(tiles_leave_no_seam),
        cmocka_unit_test(grey_and_alpha_are_read_as_they_are_meant),
        cmocka_unit_test(nan_and_infinity_are_told_and_do_not_spread),
        cmocka_unit_test(extremes_give_numbers_between_0_and_1),
        cmocka_unit_test(darkness_has_exposures_too),
        cmocka_unit_test(what_cannot_be_compared_is_refused),
        cmocka_unit_test(speed_is_that_of_a_separable_filter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

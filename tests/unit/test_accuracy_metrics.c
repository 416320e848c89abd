/* SPDX-License-Identifier: MIT */
/* Metrics of images and of transmittances: known values, positions, sums that do not lose digits,
 * and clear refusals. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/accuracy/metrics.h"

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

static void fill(const struct image *image, float value)
{
    float *pixels = image->pixels;
    for (size_t i = 0; i < image_size_bytes(image) / sizeof(float); i++)
        pixels[i] = value;
}

static struct image_metrics measure(const struct image *image, const struct image *reference,
                                    uint32_t channels)
{
    struct image_metrics metrics;
    struct error err = {0};
    if (!image_metrics_measure(&(struct image_metrics_desc){.image = image,
                                                            .reference = reference,
                                                            .channels = channels},
                               &metrics, &err))
        fail_msg("%s", err.message);
    return metrics;
}

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.17g is not %.17g +- %g", value, expected, tolerance);
}

static void an_image_is_no_distance_from_itself(void **state)
{
    (void)state;
    struct image image = image_of(31, 17, 4);
    for (int i = 0; i < 31 * 17 * 4; i++)
        ((float *)image.pixels)[i] = (float)sin(i) * 1e3f;
    struct image_metrics metrics = measure(&image, &image, 0);
    assert_true(metrics.overall.rmse == 0 && metrics.overall.mae == 0);
    assert_true(metrics.overall.p999 == 0 && metrics.overall.max == 0);
    assert_int_equal(metrics.overall.compared, 31 * 17 * 4);
    assert_int_equal(metrics.overall.differing, 0);
    assert_int_equal(metrics.channels, 4);
    image_finish(&image);
}

static void values_are_those_of_the_definition(void **state)
{
    (void)state;
    struct image image = image_of(2, 2, 2), reference = image_of(2, 2, 2);
    const float values[] = {1, 10, 2, 20, 3, 30, 4, 40}; /* x y: channel 0, channel 1 */
    memcpy(image.pixels, values, sizeof values);
    fill(&reference, 2);
    struct image_metrics metrics = measure(&image, &reference, 0);
    /* channel 0: d = -1 0 1 2; channel 1: 8 18 28 38 */
    assert_near(metrics.channel[0].rmse, sqrt(6. / 4), 1e-15);
    assert_near(metrics.channel[0].mae, 1, 1e-15);
    assert_near(metrics.channel[0].max, 2, 0);
    assert_near(metrics.channel[0].p999, 2, 0);
    assert_near(metrics.channel[0].mean_image, 2.5, 1e-15);
    assert_near(metrics.channel[0].mean_reference, 2, 1e-15);
    assert_int_equal(metrics.channel[0].differing, 3);
    assert_near(metrics.channel[1].mae, 23, 1e-14);
    assert_near(metrics.overall.mae, 12, 1e-14);
    assert_near(metrics.overall.rmse, sqrt((6. + 64 + 324 + 784 + 1444) / 8), 1e-14);
    assert_near(metrics.overall.max, 38, 0);
    assert_int_equal(metrics.overall.max_x, 1);
    assert_int_equal(metrics.overall.max_y, 1);
    assert_int_equal(metrics.overall.max_channel, 1);
    image_finish(&image);
    image_finish(&reference);
}

static void swapping_the_images_swaps_the_means_only(void **state)
{
    (void)state;
    struct image a = image_of(64, 9, 3), b = image_of(64, 9, 3);
    for (int i = 0; i < 64 * 9 * 3; i++) {
        ((float *)a.pixels)[i] = (float)sin(i * 1.1);
        ((float *)b.pixels)[i] = (float)cos(i * 0.7);
    }
    struct image_metrics one = measure(&a, &b, 0), two = measure(&b, &a, 0);
    assert_true(one.overall.rmse == two.overall.rmse && one.overall.p999 == two.overall.p999);
    assert_true(one.overall.max == two.overall.max && one.overall.max_x == two.overall.max_x);
    assert_true(one.overall.mean_image == two.overall.mean_reference);
    image_finish(&a);
    image_finish(&b);
}

static void channels_that_are_not_asked_for_do_not_count(void **state)
{
    (void)state;
    struct image image = image_of(8, 8, 4), reference = image_of(8, 8, 4);
    for (int y = 0; y < 8; y++)
        for (int x = 0; x < 8; x++)
            at(&image, x, y)[3] = 5;
    at(&image, 3, 2)[1] = -0.5f;
    struct image_metrics metrics = measure(&image, &reference, 7);
    assert_int_equal(metrics.overall.compared, 8 * 8 * 3);
    assert_int_equal(metrics.overall.differing, 1);
    assert_near(metrics.overall.max, 0.5, 0);
    assert_int_equal(metrics.overall.max_x, 3);
    assert_int_equal(metrics.overall.max_y, 2);
    assert_int_equal(metrics.overall.max_channel, 1);
    assert_near(metrics.overall.rmse, sqrt(0.25 / 192), 1e-16);
    assert_int_equal(metrics.channel[3].compared, 0);
    image_finish(&image);
    image_finish(&reference);
}

static void the_first_maximum_in_reading_order_is_told(void **state)
{
    (void)state;
    struct image image = image_of(8, 8, 3), reference = image_of(8, 8, 3);
    at(&image, 5, 4)[0] = 2;
    at(&image, 6, 1)[2] = -2;
    at(&image, 1, 7)[1] = 2;
    struct image_metrics metrics = measure(&image, &reference, 0);
    assert_int_equal(metrics.overall.max_x, 6);
    assert_int_equal(metrics.overall.max_y, 1);
    assert_int_equal(metrics.overall.max_channel, 2);
    image_finish(&image);
    image_finish(&reference);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void the_percentile_is_that_of_sorted_differences(void **state)
{
    (void)state;
    static const int sizes[] = {1, 2, 999, 1000, 1001, 1999, 2000, 10007};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        int count = sizes[s];
        struct image image = image_of(count, 1, 1), reference = image_of(count, 1, 1);
        double *sorted = calloc((size_t)count, sizeof *sorted);
        uint32_t random = 1;
        for (int i = 0; i < count; i++) {
            random = random * 1664525u + 1013904223u;
            float value = (float)ldexp((double)(random >> 8) + 1, (int)(random % 40) - 60);
            at(&image, i, 0)[0] = value;
            sorted[i] = (double)value;
        }
        qsort(sorted, (size_t)count, sizeof *sorted, compare_doubles);
        size_t rank = (size_t)ceil(0.999 * count - 1e-9);
        struct image_metrics metrics = measure(&image, &reference, 0);
        assert_near(metrics.overall.p999, sorted[rank - 1], 0);
        assert_near(metrics.channel[0].p999, sorted[rank - 1], 0);
        assert_near(metrics.overall.max, sorted[count - 1], 0);
        free(sorted);
        image_finish(&image);
        image_finish(&reference);
    }
}

static void one_pixel_in_a_thousand_does_not_move_the_percentile(void **state)
{
    (void)state;
    struct image image = image_of(100, 100, 1), reference = image_of(100, 100, 1);
    fill(&image, 0.25f);
    for (int i = 0; i < 10; i++)
        at(&image, i, i)[0] = 1e6f;
    assert_near(measure(&image, &reference, 0).overall.p999, 0.25, 0);
    at(&image, 50, 0)[0] = 1e6f;
    assert_near(measure(&image, &reference, 0).overall.p999, 1e6, 0);
    image_finish(&image);
    image_finish(&reference);
}

static void sums_of_unlike_sizes_keep_their_digits(void **state)
{
    (void)state;
    /* a row of 1e30 and one of -1e30 around rows of 1: plain f64 sums would lose every 1 */
    struct image image = image_of(1, 1002, 1), reference = image_of(1, 1002, 1);
    fill(&image, 1);
    at(&image, 0, 0)[0] = 1e30f;
    at(&image, 0, 1001)[0] = -1e30f;
    assert_near(measure(&image, &reference, 0).overall.mean_image, 1000. / 1002, 1e-15);
    /* a million differences of 1/3; a row of 1000 is off by 1000 * 2^-53 at worst */
    struct image large = image_of(1000, 1000, 1), zero = image_of(1000, 1000, 1);
    fill(&large, 1.f / 3);
    double third = (double)(1.f / 3);
    assert_near(measure(&large, &zero, 0).overall.mae / third, 1, 1.2e-13);
    assert_near(measure(&large, &zero, 0).overall.rmse / third, 1, 1.2e-13);
    image_finish(&image);
    image_finish(&reference);
    image_finish(&large);
    image_finish(&zero);
}

static void nan_and_infinity_are_counted_and_left_out(void **state)
{
    (void)state;
    struct image image = image_of(10, 1, 1), reference = image_of(10, 1, 1);
    at(&image, 0, 0)[0] = NAN;
    at(&image, 1, 0)[0] = INFINITY;
    at(&reference, 2, 0)[0] = -INFINITY;
    at(&image, 3, 0)[0] = at(&reference, 3, 0)[0] = INFINITY;
    at(&image, 4, 0)[0] = INFINITY;
    at(&reference, 4, 0)[0] = -INFINITY;
    at(&image, 5, 0)[0] = at(&reference, 5, 0)[0] = NAN;
    at(&image, 6, 0)[0] = 1;
    struct image_metrics metrics = measure(&image, &reference, 0);
    assert_int_equal(metrics.nonfinite_image, 5);
    assert_int_equal(metrics.nonfinite_reference, 4);
    assert_int_equal(metrics.nonfinite_mismatch, 5); /* all but the equal infinities */
    assert_int_equal(metrics.overall.compared, 4);
    assert_near(metrics.overall.mae, 0.25, 0);
    assert_near(metrics.overall.max, 1, 0);
    assert_int_equal(metrics.overall.max_x, 6);
    assert_int_equal(metrics.overall.differing, 5); /* 0, 1, 2, 4 and 6 */
    fill(&image, NAN);
    metrics = measure(&image, &reference, 0);
    assert_int_equal(metrics.overall.compared, 0);
    assert_true(metrics.overall.rmse == 0 && metrics.overall.p999 == 0);
    assert_int_equal(metrics.nonfinite_mismatch, 10);
    image_finish(&image);
    image_finish(&reference);
}

static void differences_at_the_end_of_the_range_stay_finite(void **state)
{
    (void)state;
    struct image image = image_of(4, 4, 3), reference = image_of(4, 4, 3);
    fill(&image, FLT_MAX);
    fill(&reference, -FLT_MAX);
    struct image_metrics metrics = measure(&image, &reference, 0);
    assert_near(metrics.overall.max, 2 * (double)FLT_MAX, 0);
    assert_near(metrics.overall.rmse / (2 * (double)FLT_MAX), 1, 1e-15);
    fill(&image, FLT_TRUE_MIN);
    fill(&reference, 0);
    metrics = measure(&image, &reference, 0);
    assert_near(metrics.overall.p999, (double)FLT_TRUE_MIN, 0);
    assert_near(metrics.overall.rmse / (double)FLT_TRUE_MIN, 1, 1e-15);
    image_finish(&image);
    image_finish(&reference);
}

static void assert_refused(const struct image *image, const struct image *reference,
                           uint32_t channels, const char *words)
{
    struct image_metrics metrics;
    struct error err = {0};
    struct image_metrics_desc desc = {.image = image, .reference = reference, .channels = channels};
    assert_false(image_metrics_measure(&desc, &metrics, &err));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    if (!strstr(err.message, words))
        fail_msg("'%s' does not say '%s'", err.message, words);
}

static void what_cannot_be_compared_is_refused_by_name(void **state)
{
    (void)state;
    struct image image = image_of(8, 4, 3), other = image_of(4, 8, 3), grey = image_of(8, 4, 1);
    struct image empty = {0}, bytes;
    struct error err = {0};
    assert_true(image_init(&bytes, 8, 4, 3, IMAGE_U8, &err));
    assert_refused(&image, &other, 0, "the image is 8 x 4 pixels, the reference 4 x 8");
    assert_refused(&image, &grey, 0, "the image has 3 channels, the reference 1");
    assert_refused(&empty, &image, 0, "the image is empty");
    assert_refused(&image, &empty, 0, "the reference is empty");
    assert_refused(&image, &bytes, 0, "the reference is not of 32-bit floats");
    assert_refused(&image, &image, 1u << 3, "channel 3 is asked for, the images have 3 channels");
    image_finish(&image);
    image_finish(&other);
    image_finish(&grey);
    image_finish(&bytes);
}

static void the_hash_sees_every_bit_and_the_shape(void **state)
{
    (void)state;
    struct image image = image_of(8, 4, 3), turned = image_of(4, 8, 3);
    uint64_t hash = image_metrics_hash(&image);
    assert_true(hash == image_metrics_hash(&image));
    assert_true(hash != image_metrics_hash(&turned));
    at(&image, 7, 3)[2] = -0.f; /* the same number, another bit */
    assert_true(hash != image_metrics_hash(&image));
    image_finish(&image);
    image_finish(&turned);
    /* FNV-1a of nothing but a zeroed head of 16 bytes: zero bytes only multiply */
    uint64_t expected = 0xcbf29ce484222325u;
    for (int i = 0; i < 16; i++)
        expected *= 0x100000001b3u;
    assert_true(image_metrics_hash(&(struct image){0}) == expected);
}

/* ---- transmittance ---- */

static struct probe_metrics probe(const float (*t)[3], const float (*reference)[3], int count)
{
    struct image images[2] = {image_of(count, 1, 3), image_of(count, 1, 3)};
    memcpy(images[0].pixels, t, (size_t)count * sizeof *t);
    memcpy(images[1].pixels, reference, (size_t)count * sizeof *reference);
    const struct image_metrics_desc desc = {.image = &images[0], .reference = &images[1]};
    struct probe_metrics metrics;
    struct error err = {0};
    if (!image_transmittance_measure(&desc, &metrics, &err))
        fail_msg("%s", err.message);
    image_finish(&images[0]);
    image_finish(&images[1]);
    return metrics;
}

static void probes_are_compared_by_their_ratio_only_where_there_is_light(void **state)
{
    (void)state;
    const float reference[][3] = {{1, 0.5f, 0.25f}, {2e-4f, 0.99e-4f, 1e-30f}, {0, 0, 1}};
    const float t[][3] = {{1, 0.51f, 0.25f}, {2.1e-4f, 8.91e-4f, 2e-30f}, {0, 1e-9f, 1}};
    struct probe_metrics metrics = probe(t, reference, 3);
    assert_int_equal(metrics.compared, 9);
    assert_near(metrics.max, 0.01, 1e-8); /* the numbers are rounded to f32 */
    assert_int_equal(metrics.max_point, 0);
    assert_int_equal(metrics.max_channel, 1);
    /* 8.91e-4 against 0.99e-4 is nine times off, but 0.99e-4 is not above the limit */
    assert_near(metrics.max_relative, 0.05, 1e-6);
    assert_int_equal(metrics.max_relative_point, 1);
    assert_int_equal(metrics.max_relative_channel, 0);
    assert_int_equal(metrics.relative_compared, 5);
    assert_near(metrics.max_tau, log(9), 1e-6);
    assert_int_equal(metrics.max_tau_point, 1);
    assert_int_equal(metrics.max_tau_channel, 1);
    assert_int_equal(metrics.opaque_mismatch, 1);
    assert_near(metrics.mean, (0.01 + 1e-5 + 7.92e-4 + 1e-30 + 1e-9) / 9, 1e-8);
}

static void optical_depth_is_compared_right_down_to_what_an_image_holds(void **state)
{
    (void)state;
    const float reference[][3] = {{0x1p-149f, 0.5f, 1}}, t[][3] = {{0x1p-148f, 0.5f, 1}};
    assert_near(probe(t, reference, 1).max_tau, log(2), 1e-12);
}

static void probes_that_are_not_finite_are_counted(void **state)
{
    (void)state;
    const float reference[][3] = {{1, NAN, 1}}, t[][3] = {{INFINITY, 1, 0.5f}};
    struct probe_metrics metrics = probe(t, reference, 1);
    assert_int_equal(metrics.nonfinite, 2);
    assert_int_equal(metrics.compared, 1);
    assert_near(metrics.rmse, 0.5, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_image_is_no_distance_from_itself),
        cmocka_unit_test(values_are_those_of_the_definition),
        cmocka_unit_test(swapping_the_images_swaps_the_means_only),
        cmocka_unit_test(channels_that_are_not_asked_for_do_not_count),
        cmocka_unit_test(the_first_maximum_in_reading_order_is_told),
        cmocka_unit_test(the_percentile_is_that_of_sorted_differences),
        cmocka_unit_test(one_pixel_in_a_thousand_does_not_move_the_percentile),
        cmocka_unit_test(sums_of_unlike_sizes_keep_their_digits),
        cmocka_unit_test(nan_and_infinity_are_counted_and_left_out),
        cmocka_unit_test(differences_at_the_end_of_the_range_stay_finite),
        cmocka_unit_test(what_cannot_be_compared_is_refused_by_name),
        cmocka_unit_test(the_hash_sees_every_bit_and_the_shape),
        cmocka_unit_test(probes_are_compared_by_their_ratio_only_where_there_is_light),
        cmocka_unit_test(optical_depth_is_compared_right_down_to_what_an_image_holds),
        cmocka_unit_test(probes_that_are_not_finite_are_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

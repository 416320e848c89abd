/* SPDX-License-Identifier: MIT */
/* Shadow edges: contours of shapes whose distance is known, and widths of ramps and of noisy
 * penumbrae. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/accuracy/edges.h"
#include "tests/support/penumbra.h"

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

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g is not %.9g +- %g", value, expected, tolerance);
}

/* Light to the right of a line through the middle, turned by `angle` and moved by `shift` along its
 * normal; the ramp is `width` pixels wide. */
static void fill_half_plane(const struct image *image, double angle, double shift, double width)
{
    double x0 = (image->width_px - 1) / 2., y0 = (image->height_px - 1) / 2.;
    for (int y = 0; y < image->height_px; y++)
        for (int x = 0; x < image->width_px; x++) {
            double d = (x - x0) * cos(angle) + (y - y0) * sin(angle) - shift;
            at(image, x, y)[0] = (float)fmin(fmax(0.5 + d / width, 0), 1);
        }
}

static void fill_disc(const struct image *image, double x0, double y0, double radius)
{
    for (int y = 0; y < image->height_px; y++)
        for (int x = 0; x < image->width_px; x++) {
            double d = hypot(x - x0, y - y0) - radius;
            at(image, x, y)[0] = (float)fmin(fmax(0.5 + d / 4, 0), 1);
        }
}

static struct edge_distance measure(const struct edge_distance_desc *desc)
{
    struct edge_distance distance;
    struct error err = {0};
    if (!edge_distance_measure(desc, &distance, &err))
        fail_msg("%s", err.message);
    return distance;
}

static void a_contour_is_no_distance_from_itself(void **state)
{
    (void)state;
    struct image image = image_of(50, 40, 1);
    fill_disc(&image, 21, 19, 11);
    struct edge_distance d =
        measure(&(struct edge_distance_desc){.image = &image, .reference = &image});
    assert_near(d.hausdorff_px, 0, 1e-12);
    assert_near(d.mean_px, 0, 1e-12);
    assert_near(d.length_image_px, 2 * M_PI * 11, 0.1);
    image_finish(&image);
}

static void a_moved_line_is_as_far_as_it_was_moved(void **state)
{
    (void)state;
    struct image image = image_of(61, 61, 1), reference = image_of(61, 61, 1);
    for (int i = 0; i < 12; i++) {
        double shift = 0.03 * (1 << (i % 9)), angle = M_PI / 2 * (i % 3);
        /* along the axes both contours go from border to border */
        fill_half_plane(&image, angle, shift, 6);
        fill_half_plane(&reference, angle, 0, 6);
        struct edge_distance d =
            measure(&(struct edge_distance_desc){.image = &image, .reference = &reference});
        assert_near(d.hausdorff_px, shift, 1e-5);
        assert_near(d.mean_px, shift, 1e-5);
        assert_near(d.length_image_px, 60, 1e-5);
        assert_near(d.length_reference_px, 60, 1e-5);
    }
    image_finish(&image);
    image_finish(&reference);
}

static void circles_are_as_far_as_their_radii(void **state)
{
    (void)state;
    struct image image = image_of(101, 101, 1), reference = image_of(101, 101, 1);
    fill_disc(&image, 50, 50, 30);
    fill_disc(&reference, 50, 50, 22.5);
    struct edge_distance_desc desc = {.image = &image, .reference = &reference};
    struct edge_distance d = measure(&desc);
    assert_near(d.hausdorff_px, 7.5, 0.02);
    assert_near(d.mean_px, 7.5, 0.02);
    /* moved: the farthest point of one is its centre's shift and the radii apart */
    fill_disc(&reference, 55, 50, 22.5);
    d = measure(&desc);
    assert_near(d.hausdorff_px, 12.5, 0.02);
    assert_near(d.max_x, 20, 1);
    assert_near(d.max_y, 50, 1);
    struct edge_distance_desc swapped = {.image = &reference, .reference = &image};
    struct edge_distance s = measure(&swapped);
    assert_near(s.hausdorff_px, d.hausdorff_px, 1e-12);
    assert_near(s.mean_px, d.mean_px, 1e-12);
    image_finish(&image);
    image_finish(&reference);
}

/* By every pair of points of both contours, drawn finely. */
static void far_contours_are_found_across_empty_buckets(void **state)
{
    (void)state;
    struct image image = image_of(400, 300, 1), reference = image_of(400, 300, 1);
    fill_disc(&image, 30, 30, 12);
    fill_disc(&reference, 360, 270, 12);
    struct edge_distance d =
        measure(&(struct edge_distance_desc){.image = &image, .reference = &reference});
    double between = hypot(330, 240);
    /* From the far side to the near side of the other. */
    assert_near(d.hausdorff_px, between, 0.02);
    double mean = 0;
    for (int i = 0; i < 720; i++) {
        double a = M_PI * i / 360;
        mean += hypot(330 - 12 * cos(a), 240 - 12 * sin(a)) - 12;
    }
    assert_near(d.mean_px, mean / 720, 0.02);
    image_finish(&image);
    image_finish(&reference);
}

static void a_contour_only_one_has_is_infinitely_far(void **state)
{
    (void)state;
    struct image image = image_of(30, 30, 1), dark = image_of(30, 30, 1);
    fill_disc(&image, 15, 15, 7);
    struct edge_distance d =
        measure(&(struct edge_distance_desc){.image = &image, .reference = &dark});
    assert_true(isinf(d.hausdorff_px) && isinf(d.mean_px));
    assert_true(d.length_reference_px == 0 && d.length_image_px > 40);
    d = measure(&(struct edge_distance_desc){.image = &dark, .reference = &dark});
    assert_true(d.hausdorff_px == 0 && d.mean_px == 0);
    image_finish(&image);
    image_finish(&dark);
}

static void saddles_do_not_cross(void **state)
{
    (void)state;
    /* a chessboard of single pixels: every cell is a saddle, every pixel its own closed square or
     * joined by the middle; either way contours of the same image agree and have a known length */
    struct image image = image_of(10, 10, 1);
    for (int y = 0; y < 10; y++)
        for (int x = 0; x < 10; x++)
            at(&image, x, y)[0] = (x + y) % 2 ? 0.8f : 0;
    struct edge_distance d =
        measure(&(struct edge_distance_desc){.image = &image, .reference = &image});
    assert_near(d.hausdorff_px, 0, 1e-12);
    /* the middle, 0.4, is dark: bright corners are cut off at 3/8 of the way */
    assert_near(d.length_image_px, 81 * 2 * M_SQRT2 * 3 / 8, 1e-5);
    for (int y = 0; y < 10; y++)
        for (int x = 0; x < 10; x++)
            at(&image, x, y)[0] = (x + y) % 2 ? 2 : 0;
    d = measure(&(struct edge_distance_desc){.image = &image, .reference = &image});
    /* the middle is lit: dark corners are cut off at 1/4 */
    assert_near(d.length_image_px, 81 * 2 * M_SQRT2 / 4, 1e-5);
    image_finish(&image);
}

static void level_and_channel_are_those_asked_for(void **state)
{
    (void)state;
    struct image image = image_of(41, 41, 3), reference = image_of(41, 41, 3);
    for (int y = 0; y < 41; y++)
        for (int x = 0; x < 41; x++) {
            at(&image, x, y)[2] = (float)x / 40;
            at(&reference, x, y)[2] = (float)x / 80;
        }
    struct edge_distance_desc desc = {
        .image = &image, .reference = &reference, .channel = 2, .level = 0.25};
    assert_near(measure(&desc).hausdorff_px, 10, 1e-5); /* x = 10 and x = 20 */
    desc.channel = 0;
    assert_near(measure(&desc).hausdorff_px, 0, 0);
    image_finish(&image);
    image_finish(&reference);
}

static void blind_cells_are_counted_and_hold_no_contour(void **state)
{
    (void)state;
    struct image image = image_of(21, 21, 1), reference = image_of(21, 21, 1);
    fill_half_plane(&image, 0, 0.25, 6);
    fill_half_plane(&reference, 0, 0, 6);
    at(&image, 10, 5)[0] = NAN;
    struct edge_distance d =
        measure(&(struct edge_distance_desc){.image = &image, .reference = &reference});
    assert_int_equal(d.blind_cells, 4);
    assert_near(d.length_image_px, 18, 1e-5);
    assert_near(d.hausdorff_px, 0.25, 1e-5);
    image_finish(&image);
    image_finish(&reference);
}

static void what_cannot_be_compared_is_refused(void **state)
{
    (void)state;
    struct image image = image_of(8, 4, 1), other = image_of(4, 8, 1);
    struct edge_distance d;
    struct error err = {0};
    assert_false(edge_distance_measure(
        &(struct edge_distance_desc){.image = &image, .reference = &other}, &d, &err));
    assert_string_equal(err.message, "the image is 8 x 4 pixels, the reference 4 x 8");
    err = (struct error){0};
    assert_false(edge_distance_measure(
        &(struct edge_distance_desc){.image = &image, .reference = &image, .channel = 1}, &d,
        &err));
    assert_string_equal(err.message, "channel 1 is asked for, the images have 1 channels");
    err = (struct error){0};
    assert_false(edge_distance_measure(
        &(struct edge_distance_desc){.image = &image, .reference = &image, .level = NAN}, &d,
        &err));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    struct image row = image_of(8, 1, 1);
    assert_true(
        measure(&(struct edge_distance_desc){.image = &row, .reference = &row}).hausdorff_px == 0);
    image_finish(&image);
    image_finish(&other);
    image_finish(&row);
}

/* ---- penumbrae ---- */

static double width_of(const struct penumbra_desc *desc)
{
    double width;
    struct error err = {0};
    if (!penumbra_width(desc, &width, &err))
        fail_msg("%s", err.message);
    return width;
}

static void a_ramp_is_four_fifths_of_its_length_wide(void **state)
{
    (void)state;
    double profile[200];
    for (int i = 0; i < 200; i++)
        profile[i] = 3 + 2 * fmin(fmax((i - 70.3) / 41.5, 0), 1);
    assert_near(width_of(&(struct penumbra_desc){.profile = profile, .count = 200}), 0.8 * 41.5,
                0.02); /* corners of the ramp lie between samples */
    for (int i = 0; i < 100; i++) {
        double swap = profile[i];
        profile[i] = profile[199 - i];
        profile[199 - i] = swap;
    }
    assert_near(width_of(&(struct penumbra_desc){.profile = profile, .count = 200}), 0.8 * 41.5,
                0.02);
    assert_near(width_of(&(struct penumbra_desc){
                    .profile = profile, .count = 200, .low = 0.25, .high = 0.75}),
                0.5 * 41.5, 0.02);
    assert_near(
        width_of(&(struct penumbra_desc){
            .profile = profile, .count = 200, .dark = 1, .lit = 6, .low = 0.5, .high = 0.7}),
        0.2 * 5 / 2 * 41.5, 0.02);
}

static void noise_moves_a_penumbra_by_no_more_than_its_size_and_widens_it_on_average(void **state)
{
    (void)state;
    double clean[300], noisy[300];
    srand(7);
    for (int i = 0; i < 300; i++)
        clean[i] = fmin(fmax((i - 100.) / 100, 0), 1);
    double expected = width_of(&(struct penumbra_desc){.profile = clean, .count = 300});
    double total = 0;
    assert_near(expected, 80, 1e-9);
    for (int round = 0; round < 50; round++) {
        for (int i = 0; i < 300; i++)
            noisy[i] = clean[i] + 0.05 * (rand() / (double)RAND_MAX - 0.5);
        double width =
            width_of(&(struct penumbra_desc){.profile = noisy, .count = 300, .dark = 0, .lit = 1});
        assert_near(width, expected, 5); /* 0.025 at a slope of 0.01, at both ends */
        total += width;
    }
    assert_true(total / 50 > expected);
}

static void a_hard_edge_is_less_than_one_sample_wide(void **state)
{
    (void)state;
    const double profile[] = {0, 0, 0, 1, 1, 1};
    assert_near(width_of(&(struct penumbra_desc){.profile = profile, .count = 6}), 0.8, 1e-12);
}

static void assert_refused(const struct penumbra_desc *desc, const char *words)
{
    double width;
    struct error err = {0};
    assert_false(penumbra_width(desc, &width, &err));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    if (!strstr(err.message, words))
        fail_msg("'%s' does not say '%s'", err.message, words);
}

static void profiles_without_an_edge_are_refused(void **state)
{
    (void)state;
    const double flat[] = {1, 1, 1}, rising[] = {0, 1}, broken[] = {0, NAN, 1};
    assert_refused(&(struct penumbra_desc){.profile = flat, .count = 3}, "has no edge");
    assert_refused(&(struct penumbra_desc){.profile = rising, .count = 1}, "has no edge");
    assert_refused(&(struct penumbra_desc){.profile = broken, .count = 3},
                   "sample 1 of the profile is not finite");
    assert_refused(&(struct penumbra_desc){.profile = rising, .count = 2, .dark = -9, .lit = 9},
                   "does not cross");
    assert_refused(&(struct penumbra_desc){.profile = rising, .count = 2, .low = 0.9, .high = 0.1},
                   "levels 0.9 and 0.1");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_contour_is_no_distance_from_itself),
        cmocka_unit_test(a_moved_line_is_as_far_as_it_was_moved),
        cmocka_unit_test(circles_are_as_far_as_their_radii),
        cmocka_unit_test(far_contours_are_found_across_empty_buckets),
        cmocka_unit_test(a_contour_only_one_has_is_infinitely_far),
        cmocka_unit_test(saddles_do_not_cross),
        cmocka_unit_test(level_and_channel_are_those_asked_for),
        cmocka_unit_test(blind_cells_are_counted_and_hold_no_contour),
        cmocka_unit_test(what_cannot_be_compared_is_refused),
        cmocka_unit_test(a_ramp_is_four_fifths_of_its_length_wide),
        cmocka_unit_test(noise_moves_a_penumbra_by_no_more_than_its_size_and_widens_it_on_average),
        cmocka_unit_test(a_hard_edge_is_less_than_one_sample_wide),
        cmocka_unit_test(profiles_without_an_edge_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* Images of radiance: what becomes of their texels, what is refused, and the blob of the result. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/environment/environment_blob.h"
#include "renderer/environment/environment_import.h"
#include "renderer/image/image.h"

static const double pi = 3.14159265358979323846;

/* An EXR whose channel c of the texel (x, y) is value(x, y, c). */
static void *write_exr(int width, int height, const char *names, float (*value)(int, int, int),
                       size_t *size_bytes)
{
    struct image image = {0};
    void *bytes = NULL;
    int channels = (int)strlen(names);
    assert_true(image_init(&image, width, height, channels, IMAGE_F32, NULL));
    for (int i = 0; i < channels; i++)
        image.channel_names[i][0] = names[i];
    for (int i = 0; i < width * height * channels; i++)
        ((float *)image.pixels)[i] =
            value(i / channels % width, i / channels / width, i % channels);
    assert_true(image_encode(&image, &(struct image_encode_desc){.format = IMAGE_FORMAT_EXR},
                             &bytes, size_bytes, NULL));
    image_finish(&image);
    return bytes;
}

static bool import_exr(int width, int height, const char *names, float (*value)(int, int, int),
                       struct environment_import *import, struct error *err)
{
    size_t size_bytes;
    void *bytes = write_exr(width, height, names, value, &size_bytes);
    bool is_good = environment_import(bytes, size_bytes, import, err);
    free(bytes);
    return is_good;
}

static float place(int x, int y, int c)
{
    return (float)(100 * y + 10 * x + c);
}

static void a_small_map_is_kept_as_it_is(void **state)
{
    (void)state;
    struct environment_import import;
    assert_true(import_exr(8, 4, "RGB", place, &import, NULL));
    assert_int_equal(8, import.width);
    assert_int_equal(4, import.height);
    for (int i = 0; i < 3 * 8 * 4; i++)
        assert_true(import.pixels[i] == place(i / 3 % 8, i / 24, i % 3));
    assert_true(import.peak == 372);
    environment_import_finish(&import);
}

static void the_mean_is_that_over_all_directions(void **state)
{
    (void)state;
    struct environment_import import;
    double mean = 0;
    assert_true(import_exr(8, 4, "RGB", place, &import, NULL));
    for (int y = 0; y < 4; y++) /* a band has half the difference of its bounds' cosines */
        mean += 0.5 * (cos(pi * y / 4) - cos(pi * (y + 1) / 4)) * (100 * y + 35);
    for (int i = 0; i < 3; i++)
        assert_true(fabs(import.mean[i] - (mean + i)) <= 1e-9 * mean);
    environment_import_finish(&import);
}

static float lamp(int x, int y, int c)
{
    return x == 17 && y == 3 ? 1e6f * (float)(c + 1) : (float)((x + y) % 5);
}

/* 1500 rows and 3000 columns become 1024 and 2048: no box has whole texels. */
static void a_large_map_is_reduced_without_losing_light(void **state)
{
    (void)state;
    struct environment_import import;
    double mean[3] = {0};
    assert_true(import_exr(3000, 1500, "RGB", lamp, &import, NULL));
    assert_int_equal(ENVIRONMENT_KEPT_WIDTH, import.width);
    assert_int_equal(ENVIRONMENT_KEPT_HEIGHT, import.height);
    assert_int_equal(3000, import.source_width);
    assert_int_equal(1500, import.source_height);
    for (int y = 0; y < 1500; y++) {
        double weight = 0.5 * (cos(pi * y / 1500) - cos(pi * (y + 1) / 1500)) / 3000;
        for (int x = 0; x < 3000; x++)
            for (int i = 0; i < 3; i++)
                mean[i] += weight * (double)lamp(x, y, i);
    }
    for (int i = 0; i < 3; i++)
        assert_true(fabs(import.mean[i] - (mean[i])) <= 1e-7 * mean[i]);
    environment_import_finish(&import);
}

static float grey(int x, int y, int c)
{
    (void)c;
    return (float)(x + y);
}

static void grey_becomes_three_channels_and_alpha_none(void **state)
{
    (void)state;
    struct environment_import import;
    const char *const names[] = {"Y", "RGBA"};
    for (size_t n = 0; n < 2; n++) {
        assert_true(import_exr(4, 2, names[n], grey, &import, NULL));
        for (int i = 0; i < 3 * 4 * 2; i++)
            assert_true(import.pixels[i] == (float)(i / 3 % 4 + i / 12));
        environment_import_finish(&import);
    }
}

static float below(int x, int y, int c)
{
    return x == 2 || (x == 1 && y == 1 && c == 1) ? -3 : 1;
}

static void negative_channels_count_as_none_and_are_counted(void **state)
{
    (void)state;
    struct environment_import import;
    assert_true(import_exr(4, 2, "RGB", below, &import, NULL));
    assert_int_equal(3, import.negative_texels);
    for (int i = 0; i < 3 * 4 * 2; i++)
        assert_true(import.pixels[i] == fmaxf(below(i / 3 % 4, i / 12, i % 3), 0));
    environment_import_finish(&import);
}

static float bad_value;

static float bad_at_3_1(int x, int y, int c)
{
    return x == 3 && y == 1 && c == 2 ? bad_value : 1;
}

static void what_is_no_radiance_is_refused_with_its_texel(void **state)
{
    (void)state;
    const float bad[] = {NAN, INFINITY, -INFINITY, 2e10f};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct environment_import import;
        struct error err = {0};
        bad_value = bad[i];
        assert_false(import_exr(4, 2, "RGB", bad_at_3_1, &import, &err));
        assert_int_equal(ERROR_INVALID_ENVIRONMENT, err.code);
        assert_non_null(strstr(err.message, "channel B of the texel in column 3 of row 1"));
        assert_null(import.pixels);
    }
}

static void other_channels_are_refused(void **state)
{
    (void)state;
    struct environment_import import;
    struct error err = {0};
    assert_false(import_exr(4, 2, "RGZ", grey, &import, &err));
    assert_int_equal(ERROR_UNSUPPORTED, err.code);
}

static void check_text(const char *text, enum error_code code, const char *words)
{
    struct environment_import import;
    struct error err = {0};
    assert_false(environment_import(text, strlen(text), &import, &err));
    assert_int_equal(code, err.code);
    if (!strstr(err.message, words))
        fail_msg("'%s' has no '%s'", err.message, words);
}

static void sizes_are_checked_before_anything_is_read(void **state)
{
    (void)state;
    check_text("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 65535\n", ERROR_TOO_LARGE,
               "65535 x 2 texels, the limit is 8192 x 4096");
    check_text("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 65535 +X 8192\n", ERROR_TOO_LARGE,
               "8192 x 65535 texels");
    check_text("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 1\n", ERROR_INVALID_ENVIRONMENT,
               "one column");
    check_text("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 4\n", ERROR_INVALID_ENVIRONMENT,
               "broken");
    check_text("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4000 +X 8000\nxx",
               ERROR_INVALID_ENVIRONMENT, "");
    check_text("GIF89a", ERROR_UNSUPPORTED, "GIF");
    check_text("", ERROR_INVALID_ENVIRONMENT, "empty");
}

/* However many bytes are missing. */
static void a_file_that_is_cut_off_is_refused(void **state)
{
    (void)state;
    size_t size_bytes;
    void *bytes = write_exr(16, 8, "RGB", place, &size_bytes);
    for (size_t size = 0; size < size_bytes; size++) {
        struct environment_import import;
        struct error err = {0};
        void *copy = malloc(size + 1); /* so that a sanitizer sees what is read beyond */
        memcpy(copy, bytes, size);
        if (environment_import(copy, size, &import, &err))
            fail_msg("%zu of %zu bytes are taken", size, size_bytes);
        assert_int_equal(ERROR_INVALID_ENVIRONMENT, err.code);
        free(copy);
    }
    free(bytes);
}

static struct environment *make_map(void)
{
    float pixels[3 * 4 * 2];
    for (int i = 0; i < 3 * 4 * 2; i++)
        pixels[i] = (float)(i * i % 7);
    return environment_create(&(struct environment_desc){pixels, 4, 2}, NULL);
}

static void *write_blob(const struct environment *map, size_t *size_bytes)
{
    uint8_t header[ENVIRONMENT_BLOB_HEADER_BYTES];
    struct environment_blob_part parts[ENVIRONMENT_BLOB_ARRAYS];
    environment_blob_parts(map, header, parts);
    *size_bytes = sizeof header;
    for (int i = 0; i < ENVIRONMENT_BLOB_ARRAYS; i++)
        *size_bytes += parts[i].size_bytes;
    uint8_t *blob = malloc(*size_bytes), *at = blob + sizeof header;
    memcpy(blob, header, sizeof header);
    for (int i = 0; i < ENVIRONMENT_BLOB_ARRAYS; i++) {
        memcpy(at, parts[i].bytes, parts[i].size_bytes);
        at += parts[i].size_bytes;
    }
    return blob;
}

static void expect_equal(struct environment_map map, struct environment_map other)
{
    assert_int_equal(map.width, other.width);
    assert_int_equal(map.height, other.height);
    assert_memory_equal(map.pixels, other.pixels,
                        3 * sizeof *map.pixels * (size_t)map.width * (size_t)map.height);
}

static void a_blob_holds_the_map_and_what_is_derived(void **state)
{
    (void)state;
    struct environment *map = make_map(), *opened;
    size_t size_bytes;
    uint8_t *blob = write_blob(map, &size_bytes);
    assert_non_null(opened = environment_blob_open(blob, size_bytes, NULL));
    expect_equal(environment_radiance_map(map), environment_radiance_map(opened));
    expect_equal(environment_diffuse_map(map), environment_diffuse_map(opened));
    for (int level = 0; level < ENVIRONMENT_LEVELS; level++)
        expect_equal(environment_specular_map(map, level), environment_specular_map(opened, level));
    struct environment_light light = environment_light_make(map, 30, 2);
    struct environment_light other = environment_light_make(opened, 30, 2);
    for (int i = 0; i < 100; i++) {
        double u[2] = {i / 100.0, fmod(i * 0.618, 1)}, direction[3], same[3];
        double density = environment_light_sample(&light, u, direction);
        assert_true(density == environment_light_sample(&other, u, same));
        assert_memory_equal(direction, same, sizeof same);
    }
    environment_destroy(opened);
    environment_destroy(map);
    free(blob);
}

static void expect_no_blob(void *blob, size_t size_bytes)
{
    struct error err = {0};
    assert_null(environment_blob_open(blob, size_bytes, &err));
    assert_int_equal(ERROR_INVALID_ENVIRONMENT, err.code);
}

static void a_blob_that_was_tampered_with_is_refused(void **state)
{
    (void)state;
    enum { HEADER = ENVIRONMENT_BLOB_HEADER_BYTES, ROWS = 8 * 3, COLUMNS = 8 * 2 * 5, BAD = 4 };
    const uint32_t bad[BAD] = {0x7fc00000, 0x7f800000, 0xbf800000, 0x5f000000}; /* NaN, inf, -1 */
    struct environment *map = make_map();
    size_t size_bytes;
    uint8_t *blob = write_blob(map, &size_bytes), *copy = malloc(size_bytes);
    size_t starts[] = {HEADER + ROWS + COLUMNS, HEADER + ROWS + COLUMNS + 12 * 8 + 4,
                       size_bytes - 4};
    for (size_t size = 0; size < size_bytes; size += size < 2000 ? 1 : 999)
        expect_no_blob(blob, size);
    for (size_t i = 0; i < 3 * BAD; i++) {
        memcpy(copy, blob, size_bytes);
        memcpy(copy + starts[i / BAD], &bad[i % BAD], sizeof *bad);
        expect_no_blob(copy, size_bytes);
    }
    for (int i = 0; i < 3 + 2 * 5; i++)
        for (int k = 0; k < 3; k++) { /* sums that are no number, negative or fall again */
            const double wrong[3] = {NAN, -0.1, 1.5};
            memcpy(copy, blob, size_bytes);
            memcpy(copy + HEADER + 8 * i, &wrong[k], sizeof wrong[k]);
            expect_no_blob(copy, size_bytes);
        }
    for (size_t i = 0; i < 20; i++) { /* letters, version, size */
        memcpy(copy, blob, size_bytes);
        copy[i]++;
        expect_no_blob(copy, size_bytes);
    }
    free(copy);
    free(blob);
    environment_destroy(map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_small_map_is_kept_as_it_is),
        cmocka_unit_test(the_mean_is_that_over_all_directions),
        cmocka_unit_test(a_large_map_is_reduced_without_losing_light),
        cmocka_unit_test(grey_becomes_three_channels_and_alpha_none),
        cmocka_unit_test(negative_channels_count_as_none_and_are_counted),
        cmocka_unit_test(what_is_no_radiance_is_refused_with_its_texel),
        cmocka_unit_test(other_channels_are_refused),
        cmocka_unit_test(sizes_are_checked_before_anything_is_read),
        cmocka_unit_test(a_file_that_is_cut_off_is_refused),
        cmocka_unit_test(a_blob_holds_the_map_and_what_is_derived),
        cmocka_unit_test(a_blob_that_was_tampered_with_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

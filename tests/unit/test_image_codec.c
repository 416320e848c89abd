/* SPDX-License-Identifier: MIT */
/* image_encode and image_decode: round trips, formats, channels, and refusals. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "renderer/image/image.h"

/* A smooth picture with all values of alpha: kind to lossy formats, hard on premultiplication. */
static struct image make_u8(int width, int height, int channels)
{
    struct image image;
    struct error err = {0};
    assert_true(image_init(&image, width, height, channels, IMAGE_U8, &err));
    uint8_t *out = image.pixels;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int c = 0; c < channels; c++) {
                bool is_alpha = channels % 2 == 0 && c == channels - 1;
                *out++ = (uint8_t)(is_alpha ? 255 * x / (width - 1)
                                            : 128 + 100 * sin(0.05 * (x + 2 * y) + c));
            }
    return image;
}

static void encode(const struct image *image, enum image_format format, int quality, void **bytes,
                   size_t *size)
{
    struct error err = {0};
    struct image_encode_desc desc = {.format = format, .quality = quality};
    if (!image_encode(image, &desc, bytes, size, &err))
        fail_msg("%s", err.message);
}

static struct image decode(const void *bytes, size_t size, bool keep_float)
{
    struct image image;
    struct error err = {0};
    struct image_decode_desc desc = {.keep_float = keep_float};
    if (!image_decode(bytes, size, &desc, &image, &err))
        fail_msg("%s", err.message);
    return image;
}

static struct image round_trip(const struct image *image, enum image_format format, int quality,
                               bool keep_float)
{
    void *bytes;
    size_t size;
    encode(image, format, quality, &bytes, &size);
    struct image back = decode(bytes, size, keep_float);
    free(bytes);
    assert_int_equal(back.width_px, image->width_px);
    assert_int_equal(back.height_px, image->height_px);
    return back;
}

/* Root mean square difference of the first `compared` channels; grey counts as three equal ones. */
static double difference(const struct image *a, const struct image *rgba, int compared)
{
    const uint8_t *p = a->pixels, *q = rgba->pixels;
    size_t count = (size_t)a->width_px * (size_t)a->height_px;
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < compared; c++) {
            int source = c == 3 ? a->channels - 1 : a->channels < 3 ? 0 : c;
            double d = p[i * (size_t)a->channels + (size_t)source] - q[i * 4 + (size_t)c];
            sum += d * d;
        }
    return sqrt(sum / ((double)count * compared));
}

static void png_keeps_every_bit_of_one_to_four_channels(void **state)
{
    (void)state;
    for (int channels = 1; channels <= 4; channels++) {
        struct image image = make_u8(67, 31, channels);
        struct image back = round_trip(&image, IMAGE_FORMAT_PNG, 0, false);
        assert_int_equal(back.channels, 4);
        assert_int_equal(back.component, IMAGE_U8);
        assert_true(difference(&image, &back, channels % 2 ? 3 : 4) == 0);
        if (channels % 2)
            assert_int_equal(((uint8_t *)back.pixels)[3], 255);
        image_finish(&image);
        image_finish(&back);
    }
}

static void png_of_16_bits_is_read_as_8(void **state)
{
    (void)state;
    struct image image;
    struct error err = {0};
    assert_true(image_init(&image, 256, 2, 3, IMAGE_U16, &err));
    uint16_t *out = image.pixels;
    for (int i = 0; i < 256 * 2 * 3; i++)
        out[i] = (uint16_t)(i / 3 % 256 * 257);
    struct image back = round_trip(&image, IMAGE_FORMAT_PNG, 0, false);
    const uint8_t *in = back.pixels;
    for (int i = 0; i < 512; i++)
        assert_int_equal(in[4 * i], i % 256);
    image_finish(&image);
    image_finish(&back);
}

static void jpeg_and_webp_stay_close(void **state)
{
    (void)state;
    for (int channels = 1; channels <= 4; channels++) {
        struct image image = make_u8(96, 64, channels);
        struct image jpeg = round_trip(&image, IMAGE_FORMAT_JPEG, 95, false);
        assert_true(difference(&image, &jpeg, 3) < 3);
        assert_int_equal(((uint8_t *)jpeg.pixels)[3], 255);
        image_finish(&jpeg);
        struct image webp = round_trip(&image, IMAGE_FORMAT_WEBP, 95, false);
        assert_true(difference(&image, &webp, channels % 2 ? 3 : 4) < 4);
        image_finish(&webp);
        image_finish(&image);
    }
}

static void webp_of_quality_100_is_lossless(void **state)
{
    (void)state;
    struct image image = make_u8(64, 48, 4);
    struct image back = round_trip(&image, IMAGE_FORMAT_WEBP, 100, false);
    assert_memory_equal(image.pixels, back.pixels, image_size_bytes(&image));
    image_finish(&image);
    image_finish(&back);
}

static void lower_quality_makes_smaller_files(void **state)
{
    (void)state;
    struct image image = make_u8(160, 120, 3);
    uint8_t *noise = image.pixels;
    srand(3);
    for (int i = 0; i < 160 * 120 * 3; i++)
        noise[i] = (uint8_t)(noise[i] + rand() % 16);
    const enum image_format formats[] = {IMAGE_FORMAT_JPEG, IMAGE_FORMAT_WEBP};
    for (int i = 0; i < 2; i++) {
        void *low, *high;
        size_t low_size, high_size;
        encode(&image, formats[i], 20, &low, &low_size);
        encode(&image, formats[i], 90, &high, &high_size);
        assert_true(low_size * 2 < high_size);
        free(low);
        free(high);
    }
    image_finish(&image);
}

static void exr_keeps_floats_and_channel_names(void **state)
{
    (void)state;
    static const char *const names[] = {"A", "B", "G", "N.X", "N.Y", "R", "Z"};
    struct image image;
    struct error err = {0};
    assert_true(image_init(&image, 33, 17, 7, IMAGE_F32, &err));
    float *out = image.pixels;
    for (int i = 0; i < 33 * 17 * 7; i++)
        out[i] = ldexpf((float)(i % 97) - 48, i % 60 - 30);
    out[6] = INFINITY; /* a depth without surface */
    for (int c = 0; c < 7; c++)
        strcpy(image.channel_names[c], names[c]);
    struct image back = round_trip(&image, IMAGE_FORMAT_EXR, 0, true);
    assert_int_equal(back.component, IMAGE_F32);
    assert_int_equal(back.channels, 7);
    for (int c = 0; c < 7; c++) {
        int found = -1; /* the library may put R, G, B and A first */
        for (int k = 0; k < 7; k++)
            if (strcmp(back.channel_names[k], names[c]) == 0)
                found = k;
        assert_true(found >= 0);
        for (int i = 0; i < 33 * 17; i++)
            assert_true(((float *)back.pixels)[i * 7 + found] == out[i * 7 + c]);
    }
    image_finish(&image);
    image_finish(&back);
}

static void exr_does_not_touch_associated_colour(void **state)
{
    (void)state;
    struct image image;
    struct error err = {0};
    assert_true(image_init(&image, 2, 1, 4, IMAGE_F32, &err));
    float pixels[8] = {0.5f, 2, 0.25f, 0.25f, 3, 2, 1, 0};
    memcpy(image.pixels, pixels, sizeof pixels);
    struct image back = round_trip(&image, IMAGE_FORMAT_EXR, 0, true);
    assert_string_equal(back.channel_names[0], "R");
    assert_string_equal(back.channel_names[3], "A");
    assert_memory_equal(back.pixels, pixels, sizeof pixels);
    image_finish(&image);
    image_finish(&back);
}

static void exr_keeps_small_integers(void **state)
{
    (void)state;
    struct image image;
    struct error err = {0};
    assert_true(image_init(&image, 40, 30, 1, IMAGE_U32, &err));
    strcpy(image.channel_names[0], "node");
    for (uint32_t i = 0; i < 1200; i++)
        ((uint32_t *)image.pixels)[i] = i * 7;
    void *bytes;
    size_t size;
    encode(&image, IMAGE_FORMAT_EXR, 0, &bytes, &size);
    /* the channel list says UINT (0): name, NUL, then the pixel type */
    const char *channel = memmem(bytes, size, "node\0\0\0\0\0", 9);
    assert_non_null(channel);
    struct image back = decode(bytes, size, true);
    assert_int_equal(back.component, IMAGE_U32);
    assert_string_equal(back.channel_names[0], "node");
    for (uint32_t i = 0; i < 1200; i++)
        assert_true(((uint32_t *)back.pixels)[i] == i * 7);
    free(bytes);
    image_finish(&image);
    image_finish(&back);
}

static void equal_images_give_equal_bytes(void **state)
{
    (void)state;
    struct image u8 = make_u8(40, 30, 4), f32;
    struct error err = {0};
    assert_true(image_init(&f32, 40, 30, 4, IMAGE_F32, &err));
    void *first[IMAGE_FORMAT_COUNT], *second;
    size_t first_size[IMAGE_FORMAT_COUNT], size;
    for (int f = 0; f < IMAGE_FORMAT_COUNT; f++)
        encode(f == IMAGE_FORMAT_EXR ? &f32 : &u8, (enum image_format)f, 0, &first[f],
               &first_size[f]);
    usleep(1100 * 1000); /* past the next second of any time stamp */
    for (int f = 0; f < IMAGE_FORMAT_COUNT; f++) {
        encode(f == IMAGE_FORMAT_EXR ? &f32 : &u8, (enum image_format)f, 0, &second, &size);
        assert_int_equal(size, first_size[f]);
        assert_memory_equal(second, first[f], size);
        free(first[f]);
        free(second);
    }
    image_finish(&u8);
    image_finish(&f32);
}

static void a_description_is_stored(void **state)
{
    (void)state;
    struct image image = make_u8(8, 8, 4);
    const enum image_format formats[] = {IMAGE_FORMAT_PNG, IMAGE_FORMAT_JPEG};
    for (int i = 0; i < 2; i++) {
        struct error err = {0};
        void *bytes;
        size_t size;
        assert_true(image_encode(
            &image,
            &(struct image_encode_desc){.format = formats[i], .description = "scene 3f revision 7"},
            &bytes, &size, &err));
        assert_non_null(memmem(bytes, size, "scene 3f revision 7", 19));
        free(bytes);
    }
    image_finish(&image);
}

/* The same picture, whichever channels it is given in; its file outgrows what is set aside. */
static void jpeg_leaves_alpha_out(void **state)
{
    (void)state;
    struct image rgba = make_u8(400, 300, 4), rgb = make_u8(400, 300, 3);
    uint8_t *with = rgba.pixels, *without = rgb.pixels;
    void *files[2];
    size_t sizes[2];
    srand(5);
    for (int i = 0; i < 400 * 300; i++)
        for (int c = 0; c < 4; c++) {
            with[4 * i + c] = (uint8_t)rand();
            if (c < 3)
                without[3 * i + c] = with[4 * i + c];
        }
    encode(&rgba, IMAGE_FORMAT_JPEG, 95, &files[0], &sizes[0]);
    encode(&rgb, IMAGE_FORMAT_JPEG, 95, &files[1], &sizes[1]);
    assert_true(sizes[0] > 65536);
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(files[0], files[1], sizes[0]);
    const uint8_t *end = (const uint8_t *)files[0] + sizes[0] - 2;
    assert_true(end[0] == 0xff && end[1] == 0xd9);
    free(files[0]);
    free(files[1]);
    image_finish(&rgba);
    image_finish(&rgb);
}

static void jpeg_has_a_largest_side(void **state)
{
    (void)state;
    struct image image = make_u8(65501, 1, 3);
    struct error err = {0};
    void *bytes;
    size_t size;
    assert_false(image_encode(&image, &(struct image_encode_desc){.format = IMAGE_FORMAT_JPEG},
                              &bytes, &size, &err));
    assert_int_equal(err.code, ERROR_NOT_ACCEPTABLE);
    assert_string_equal(err.message,
                        "jpeg holds images up to 65500 pixels a side, this is 65501 x 1");
    image_finish(&image);
}

static void wrong_components_and_qualities_are_refused(void **state)
{
    (void)state;
    struct image u8 = make_u8(4, 4, 3), f32, many, empty = {0};
    struct error err = {0};
    assert_true(image_init(&f32, 4, 4, 3, IMAGE_F32, &err));
    assert_true(image_init(&many, 4, 4, 5, IMAGE_U8, &err));
    const struct {
        const struct image *image;
        struct image_encode_desc desc;
        enum error_code code;
    } cases[] = {
        {&f32, {.format = IMAGE_FORMAT_PNG}, ERROR_NOT_ACCEPTABLE},
        {&f32, {.format = IMAGE_FORMAT_JPEG}, ERROR_NOT_ACCEPTABLE},
        {&u8, {.format = IMAGE_FORMAT_EXR}, ERROR_NOT_ACCEPTABLE},
        {&many, {.format = IMAGE_FORMAT_WEBP}, ERROR_NOT_ACCEPTABLE},
        {&u8, {.format = IMAGE_FORMAT_JPEG, .quality = 101}, ERROR_INVALID_REQUEST},
        {&u8, {.format = IMAGE_FORMAT_JPEG, .quality = -1}, ERROR_INVALID_REQUEST},
        {&u8, {.format = IMAGE_FORMAT_COUNT}, ERROR_INVALID_REQUEST},
        {&empty, {.format = IMAGE_FORMAT_PNG}, ERROR_INVALID_REQUEST},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        void *bytes = &bytes;
        size_t size = 1;
        memset(&err, 0, sizeof err);
        assert_false(image_encode(cases[i].image, &cases[i].desc, &bytes, &size, &err));
        assert_int_equal(err.code, cases[i].code);
        assert_null(bytes);
        assert_int_equal(size, 0);
    }
    image_finish(&u8);
    image_finish(&f32);
    image_finish(&many);
}

static void cut_off_files_are_refused(void **state)
{
    (void)state;
    struct image u8 = make_u8(24, 16, 3), f32;
    struct error err = {0};
    assert_true(image_init(&f32, 24, 16, 3, IMAGE_F32, &err));
    for (int f = 0; f < IMAGE_FORMAT_COUNT; f++) {
        void *bytes;
        size_t size, refused = 0, tried = 0;
        encode(f == IMAGE_FORMAT_EXR ? &f32 : &u8, (enum image_format)f, 0, &bytes, &size);
        for (size_t cut = 0; cut < size; cut += cut < 64 ? 1 : 13) {
            void *part = malloc(cut + 1);
            memcpy(part, bytes, cut);
            tried++;
            struct image image;
            memset(&err, 0, sizeof err);
            if (image_decode(part, cut, &(struct image_decode_desc){.keep_float = true}, &image,
                             &err))
                image_finish(&image);
            else
                refused++;
            assert_int_not_equal(err.code, ERROR_INTERNAL);
            free(part);
        }
        assert_int_equal(refused, tried);
        free(bytes);
    }
    image_finish(&u8);
    image_finish(&f32);
}

static void large_images_are_refused_before_decoding(void **state)
{
    (void)state;
    struct image image = make_u8(100, 100, 3), back;
    const enum image_format formats[] = {IMAGE_FORMAT_PNG, IMAGE_FORMAT_JPEG, IMAGE_FORMAT_WEBP};
    for (int i = 0; i < 3; i++) {
        void *bytes;
        size_t size;
        struct error err = {0};
        encode(&image, formats[i], 0, &bytes, &size);
        assert_false(image_decode(bytes, size, &(struct image_decode_desc){.max_pixels = 9999},
                                  &back, &err));
        assert_int_equal(err.code, ERROR_TOO_LARGE);
        assert_non_null(strstr(err.message, "100 x 100, limit is 9999"));
        free(bytes);
    }
    image_finish(&image);
}

static void float_images_are_refused_unless_asked_for(void **state)
{
    (void)state;
    struct image image, back;
    struct error err = {0};
    void *bytes;
    size_t size;
    assert_true(image_init(&image, 4, 4, 3, IMAGE_F32, &err));
    encode(&image, IMAGE_FORMAT_EXR, 0, &bytes, &size);
    assert_false(image_decode(bytes, size, &(struct image_decode_desc){0}, &back, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    free(bytes);
    image_finish(&image);
}

static void formats_go_by_name(void **state)
{
    (void)state;
    for (int f = 0; f < IMAGE_FORMAT_COUNT; f++) {
        enum image_format found = IMAGE_FORMAT_COUNT;
        assert_true(image_format_from_name(image_format_name((enum image_format)f), &found));
        assert_int_equal(found, f);
    }
    enum image_format found;
    assert_true(image_format_from_name("JPG", &found));
    assert_int_equal(found, IMAGE_FORMAT_JPEG);
    assert_false(image_format_from_name("tiff", &found));
}

static void image_sizes_that_overflow_are_refused(void **state)
{
    (void)state;
    struct image image;
    struct error err = {0};
    assert_false(image_init(&image, 0, 5, 4, IMAGE_U8, &err));
    assert_false(image_init(&image, 5, -1, 4, IMAGE_U8, &err));
    assert_false(image_init(&image, 5, 5, IMAGE_CHANNELS_MAX + 1, IMAGE_U8, &err));
    memset(&err, 0, sizeof err);
    assert_false(image_init(&image, INT32_MAX, INT32_MAX, 32, IMAGE_F32, &err));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
    assert_null(image.pixels);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png_keeps_every_bit_of_one_to_four_channels),
        cmocka_unit_test(png_of_16_bits_is_read_as_8),
        cmocka_unit_test(jpeg_and_webp_stay_close),
        cmocka_unit_test(jpeg_leaves_alpha_out),
        cmocka_unit_test(jpeg_has_a_largest_side),
        cmocka_unit_test(webp_of_quality_100_is_lossless),
        cmocka_unit_test(lower_quality_makes_smaller_files),
        cmocka_unit_test(exr_keeps_floats_and_channel_names),
        cmocka_unit_test(exr_does_not_touch_associated_colour),
        cmocka_unit_test(exr_keeps_small_integers),
        cmocka_unit_test(equal_images_give_equal_bytes),
        cmocka_unit_test(a_description_is_stored),
        cmocka_unit_test(wrong_components_and_qualities_are_refused),
        cmocka_unit_test(cut_off_files_are_refused),
        cmocka_unit_test(large_images_are_refused_before_decoding),
        cmocka_unit_test(float_images_are_refused_unless_asked_for),
        cmocka_unit_test(formats_go_by_name),
        cmocka_unit_test(image_sizes_that_overflow_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: MIT */
/* Kinds of PNG and JPEG that our own encoders do not write: palettes, few bits, one transparent
 * colour, interlaced, four inks; and files that are damaged or lie. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>
#include <png.h>

#include "renderer/image/image.h"

enum { WIDTH = 13, HEIGHT = 9 }; /* neither a whole number of bytes of bits, nor of blocks */

struct file {
    uint8_t bytes[1 << 16];
    size_t size;
};

static void append(png_structp png, png_bytep data, size_t length)
{
    struct file *file = png_get_io_ptr(png);
    assert_true(length <= sizeof file->bytes - file->size);
    memcpy(file->bytes + file->size, data, length);
    file->size += length;
}

struct png_case {
    int color_type, bits;
    bool is_interlaced, has_key; /* the value or index 1 is transparent */
};

/* Value of a sample: any of the depth, another one at each place. */
static int sample(const struct png_case *c, int x, int y, int channel)
{
    int most = c->color_type == PNG_COLOR_TYPE_PALETTE ? 3 : (1 << c->bits) - 1;
    return (x * 7 + y * 5 + channel * 3) % 101 * most / 100;
}

static int channels_of(int color_type)
{
    return color_type == PNG_COLOR_TYPE_RGB          ? 3
           : color_type == PNG_COLOR_TYPE_RGB_ALPHA  ? 4
           : color_type == PNG_COLOR_TYPE_GRAY_ALPHA ? 2
                                                     : 1;
}

static const png_color palette[4] = {{10, 20, 30}, {255, 0, 1}, {2, 254, 3}, {77, 88, 99}};

static void write_png(const struct png_case *c, struct file *file)
{
    int channels = channels_of(c->color_type);
    size_t row_bytes = (size_t)(WIDTH * channels * c->bits + 7) / 8;
    uint8_t *pixels = calloc(HEIGHT, row_bytes);
    png_bytep rows[HEIGHT];
    for (int y = 0; y < HEIGHT; y++) {
        rows[y] = pixels + (size_t)y * row_bytes;
        for (int x = 0; x < WIDTH; x++)
            for (int k = 0; k < channels; k++) {
                int at = (x * channels + k) * c->bits, value = sample(c, x, y, k);
                if (c->bits == 16)
                    rows[y][at / 8] = (uint8_t)(value >> 8), rows[y][at / 8 + 1] = (uint8_t)value;
                else
                    rows[y][at / 8] |= (uint8_t)(value << (8 - c->bits - at % 8));
            }
    }
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    file->size = 0;
    png_set_write_fn(png, file, append, NULL);
    png_set_IHDR(png, info, WIDTH, HEIGHT, c->bits, c->color_type,
                 c->is_interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_gAMA(png, info, 0.2); /* to be ignored */
    if (c->color_type == PNG_COLOR_TYPE_PALETTE)
        png_set_PLTE(png, info, palette, 4);
    if (c->has_key)
        png_set_tRNS(png, info, (const png_byte[]){255, 0}, 2,
                     &(png_color_16){.gray = 1, .red = 1, .green = 1, .blue = 1});
    png_write_info(png, info);
    png_write_image(png, rows);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    free(pixels);
}

/* Of the RGBA that is to be read, by the definition of the format (13.12: depths are scaled). */
static int expected(const struct png_case *c, int x, int y, int channel)
{
    int first = sample(c, x, y, 0), channels = channels_of(c->color_type);
    bool is_grey = channels < 3, is_key = first == 1;
    if (c->color_type == PNG_COLOR_TYPE_PALETTE) {
        const png_color *color = &palette[first];
        const int rgba[4] = {color->red, color->green, color->blue, c->has_key && is_key ? 0 : 255};
        return rgba[channel];
    }
    for (int k = 1; k < channels && c->has_key; k++)
        is_key = is_key && sample(c, x, y, k) == 1;
    if (channel == 3 && channels % 2)
        return c->has_key && is_key ? 0 : 255;
    int value = sample(c, x, y, channel == 3 ? channels - 1 : is_grey ? 0 : channel);
    int most = (1 << c->bits) - 1;
    return (value * 255 + most / 2) / most;
}

static void every_kind_of_png_is_read(void **state)
{
    (void)state;
    static const struct png_case cases[] = {
        {PNG_COLOR_TYPE_GRAY, 1, false, false},       {PNG_COLOR_TYPE_GRAY, 2, true, false},
        {PNG_COLOR_TYPE_GRAY, 4, false, true},        {PNG_COLOR_TYPE_GRAY, 8, true, true},
        {PNG_COLOR_TYPE_GRAY, 16, false, false},      {PNG_COLOR_TYPE_GRAY_ALPHA, 8, true, false},
        {PNG_COLOR_TYPE_GRAY_ALPHA, 16, true, false}, {PNG_COLOR_TYPE_RGB, 8, false, true},
        {PNG_COLOR_TYPE_RGB, 8, true, false},         {PNG_COLOR_TYPE_RGB, 16, true, false},
        {PNG_COLOR_TYPE_RGB_ALPHA, 8, true, false},   {PNG_COLOR_TYPE_RGB_ALPHA, 16, false, false},
        {PNG_COLOR_TYPE_PALETTE, 2, false, false},    {PNG_COLOR_TYPE_PALETTE, 4, true, true},
        {PNG_COLOR_TYPE_PALETTE, 8, false, true},
    };
    static struct file file;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct image image;
        struct error err = {0};
        write_png(&cases[i], &file);
        if (!image_decode(file.bytes, file.size, &(struct image_decode_desc){0}, &image, &err))
            fail_msg("case %zu: %s", i, err.message);
        const uint8_t *at = image.pixels;
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++)
                for (int k = 0; k < 4; k++, at++)
                    if (*at != expected(&cases[i], x, y, k))
                        fail_msg("case %zu, %d,%d, channel %d: %d instead of %d", i, x, y, k, *at,
                                 expected(&cases[i], x, y, k));
        image_finish(&image);
    }
}

static void sixteen_bits_stay_where_asked_for(void **state)
{
    (void)state;
    static const int types[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                PNG_COLOR_TYPE_RGB_ALPHA};
    static struct file file;
    for (int i = 0; i < 4; i++) {
        const struct png_case c = {types[i], 16, i % 2 == 1, false};
        struct image image;
        struct error err = {0};
        write_png(&c, &file);
        assert_true(image_decode(file.bytes, file.size,
                                 &(struct image_decode_desc){.keep_16_bits = true}, &image, &err));
        assert_int_equal(IMAGE_U16, image.component);
        assert_int_equal(i + 1, image.channels);
        const uint16_t *at = image.pixels;
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++)
                for (int k = 0; k <= i; k++)
                    assert_int_equal(sample(&c, x, y, k), *at++);
        image_finish(&image);
    }
}

/* All that is not a header: a changed byte is found by the checksum of its chunk, or is no pixel.
 */
static void a_damaged_png_is_refused_or_unharmed(void **state)
{
    (void)state;
    const struct png_case c = {PNG_COLOR_TYPE_RGB, 8, false, false};
    static struct file file;
    struct image whole, image;
    struct error err = {0};
    size_t refused = 0;
    write_png(&c, &file);
    assert_true(image_decode(file.bytes, file.size, &(struct image_decode_desc){0}, &whole, &err));
    for (size_t at = 33; at < file.size; at++) {
        file.bytes[at] ^= 0x40;
        err = (struct error){0};
        if (image_decode(file.bytes, file.size, &(struct image_decode_desc){0}, &image, &err)) {
            assert_memory_equal(whole.pixels, image.pixels, image_size_bytes(&whole));
            image_finish(&image);
        } else {
            refused++;
            assert_true(err.code == ERROR_INVALID_SCENE && err.message[0]);
            assert_null(image.pixels);
        }
        file.bytes[at] ^= 0x40;
    }
    assert_true(refused > file.size / 2);
    image_finish(&whole);
}

/* Four flat inks: what is left of each, as Adobe's programs write, or how much there is. */
static void write_inks(const uint8_t inks[4], bool is_adobe, struct file *file)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    unsigned char *bytes = NULL;
    unsigned long size = 0;
    uint8_t row[4 * WIDTH];
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &bytes, &size);
    jpeg.image_width = WIDTH;
    jpeg.image_height = HEIGHT;
    jpeg.input_components = 4;
    jpeg.in_color_space = JCS_CMYK;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 100, TRUE);
    jpeg.write_Adobe_marker = is_adobe;
    jpeg_start_compress(&jpeg, TRUE);
    for (int x = 0; x < WIDTH; x++)
        memcpy(row + 4 * x, inks, 4);
    for (int y = 0; y < HEIGHT; y++)
        jpeg_write_scanlines(&jpeg, (JSAMPROW[]){row}, 1);
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    assert_true(size <= sizeof file->bytes);
    memcpy(file->bytes, bytes, size);
    file->size = size;
    free(bytes);
}

static void four_inks_become_colours(void **state)
{
    (void)state;
    static const uint8_t inks[4] = {200, 100, 40, 180};
    static struct file file;
    for (int is_adobe = 0; is_adobe < 2; is_adobe++) {
        struct image image;
        struct error err = {0};
        write_inks(inks, is_adobe, &file);
        if (!image_decode(file.bytes, file.size, &(struct image_decode_desc){0}, &image, &err))
            fail_msg("%s", err.message);
        const uint8_t *rgba = image.pixels;
        for (int i = 0; i < WIDTH * HEIGHT; i++, rgba += 4) {
            for (int c = 0; c < 3; c++) {
                double ink = inks[c] / 255.0, black = inks[3] / 255.0;
                double light = is_adobe ? ink * black : (1 - ink) * (1 - black);
                assert_true(abs(rgba[c] - (int)(255 * light + 0.5)) <= 1);
            }
            assert_int_equal(255, rgba[3]);
        }
        image_finish(&image);
    }
}

/* A frame of a kind that libjpeg does not know, and a file without tables. */
static void a_jpeg_that_cannot_be_read_is_refused(void **state)
{
    (void)state;
    static struct file file;
    struct image image;
    struct error err = {0};
    write_inks((const uint8_t[4]){1, 2, 3, 4}, true, &file);
    uint8_t *frame = memmem(file.bytes, file.size, "\xff\xc0", 2);
    assert_non_null(frame);
    frame[1] = 0xc3; /* lossless */
    assert_false(image_decode(file.bytes, file.size, &(struct image_decode_desc){0}, &image, &err));
    assert_int_equal(ERROR_INVALID_SCENE, err.code);
    assert_non_null(strstr(err.message, "jpeg: "));
    frame[1] = 0xc0;
    uint8_t *tables = memmem(file.bytes, file.size, "\xff\xdb", 2);
    assert_non_null(tables);
    tables[1] = 0xec; /* an application's segment */
    err = (struct error){0};
    assert_false(image_decode(file.bytes, file.size, &(struct image_decode_desc){0}, &image, &err));
    assert_int_equal(ERROR_INVALID_SCENE, err.code);
    assert_null(image.pixels);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_png_is_read),
        cmocka_unit_test(sixteen_bits_stay_where_asked_for),
        cmocka_unit_test(a_damaged_png_is_refused_or_unharmed),
        cmocka_unit_test(four_inks_become_colours),
        cmocka_unit_test(a_jpeg_that_cannot_be_read_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

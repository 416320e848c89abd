/* SPDX-License-Identifier: MIT */
/* PNG files are read to the bit as libpng reads them, whichever way is taken, and what is damaged
 * is refused where it refuses it: renderer/image/png_codec, png_plain. */
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/image/png_codec.h"

enum { FILE_MAX_BYTES = 1 << 20, SIDE_MAX = 400 };

struct memory_file {
    uint8_t bytes[FILE_MAX_BYTES];
    size_t size, at;
};

struct sample {
    int width, height, color_type, filters, interlace;
    size_t chunk_bytes;                      /* of pixel data */
    bool has_others;                         /* a text and a gamma before them */
    bool has_transparent;                    /* one colour is */
    uint8_t pixels[4 * SIDE_MAX * SIDE_MAX]; /* in the channels of the file */
};

static void append(png_structp png, png_bytep data, size_t length)
{
    struct memory_file *file = png_get_io_ptr(png);
    assert_true(length <= FILE_MAX_BYTES - file->size);
    memcpy(file->bytes + file->size, data, length);
    file->size += length;
}

static void take(png_structp png, png_bytep data, size_t length)
{
    struct memory_file *file = png_get_io_ptr(png);
    if (length > file->size - file->at)
        png_error(png, "the file ends early");
    memcpy(data, file->bytes + file->at, length);
    file->at += length;
}

static void ignore(png_structp png, const char *text)
{
    (void)png;
    (void)text;
}

static void leave(png_structp png, const char *text)
{
    (void)text;
    longjmp(png_jmpbuf(png), 1);
}

static size_t channels_of(int color_type)
{
    return color_type == PNG_COLOR_TYPE_GRAY ? 1 : color_type == PNG_COLOR_TYPE_RGB ? 3 : 4;
}

static void write_others(png_structp png, png_infop info, const struct sample *sample)
{
    png_color_16 transparent = {.gray = 7, .red = 7, .green = 7, .blue = 7};
    png_text text = {.compression = PNG_TEXT_COMPRESSION_NONE,
                     .key = (char *)(uintptr_t) "Title",
                     .text = (char *)(uintptr_t) "glass",
                     .text_length = 5};
    if (sample->has_others) {
        png_set_text(png, info, &text, 1);
        png_set_gAMA(png, info, 0.4);
    }
    if (sample->has_transparent)
        png_set_tRNS(png, info, NULL, 0, &transparent);
}

static void write_sample(const struct sample *sample, struct memory_file *file)
{
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, ignore);
    png_infop info = png_create_info_struct(png);
    size_t row = channels_of(sample->color_type) * (size_t)sample->width;
    file->size = file->at = 0;
    assert_int_equal(setjmp(png_jmpbuf(png)), 0); /* NOLINT(cert-err52-cpp): libpng's way */
    png_set_write_fn(png, file, append, NULL);
    if (sample->chunk_bytes)
        png_set_compression_buffer_size(png, sample->chunk_bytes);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, sample->filters);
    png_set_IHDR(png, info, (png_uint_32)sample->width, (png_uint_32)sample->height, 8,
                 sample->color_type, sample->interlace, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    write_others(png, info, sample);
    png_write_info(png, info);
    int passes = png_set_interlace_handling(png);
    for (int pass = 0; pass < passes; pass++)
        for (int y = 0; y < sample->height; y++)
            png_write_row(png, sample->pixels + (size_t)y * row);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
}

/* Smooth with some noise, and runs of one value: each filter and each kind of match occurs. */
static void fill(struct sample *sample, unsigned seed)
{
    size_t channels = channels_of(sample->color_type), row = channels * (size_t)sample->width;
    for (size_t i = 0; i < row * (size_t)sample->height; i++) {
        size_t x = i % row / channels, y = i / row, c = i % channels;
        seed = seed * 1664525 + 1013904223;
        unsigned noise = (x / 16 + y / 16) % 3 ? seed >> 29 : 0;
        sample->pixels[i] = (uint8_t)((x * (c + 1) + 3 * y) / 2 + noise * noise * (seed >> 28));
    }
}

static void expect_rgba(const struct sample *sample, const uint8_t *rgba)
{
    size_t channels = channels_of(sample->color_type);
    for (size_t i = 0; i < (size_t)sample->width * (size_t)sample->height; i++, rgba += 4) {
        const uint8_t *from = sample->pixels + channels * i;
        bool is_transparent = sample->has_transparent && from[0] == 7 &&
                              (channels == 1 || (from[1] == 7 && from[2] == 7));
        for (size_t c = 0; c < 3; c++)
            assert_int_equal(rgba[c], from[channels == 1 ? 0 : c]);
        assert_int_equal(rgba[3], channels == 4 ? from[3] : is_transparent ? 0 : 255);
    }
}

static void check_sample(const struct sample *sample, struct memory_file *file)
{
    struct image image;
    struct error err = {0};
    write_sample(sample, file);
    assert_true(png_file_decode(file->bytes, file->size, false, &image, &err));
    assert_int_equal(image.width_px, sample->width);
    assert_int_equal(image.height_px, sample->height);
    assert_true(image.channels == 4 && image.component == IMAGE_U8);
    expect_rgba(sample, image.pixels);
    image_finish(&image);
}

static void pixels_come_back_as_they_were_written(void **state)
{
    (void)state;
    static const int kinds[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGBA};
    static const int filters[] = {PNG_FILTER_NONE, PNG_FILTER_SUB,   PNG_FILTER_UP,
                                  PNG_FILTER_AVG,  PNG_FILTER_PAETH, PNG_ALL_FILTERS};
    static const int sides[][2] = {{1, 1}, {1, 9}, {9, 1}, {2, 3}, {37, 21}, {301, 203}};
    struct sample *sample = calloc(1, sizeof *sample);
    struct memory_file *file = malloc(sizeof *file);
    assert_true(sample && file);
    for (unsigned i = 0; i < 3 * 6 * 6; i++) {
        sample->width = sides[i % 6][0];
        sample->height = sides[i % 6][1];
        sample->filters = filters[i / 6 % 6];
        sample->color_type = kinds[i / 36];
        sample->chunk_bytes = i % 2 ? 100 : 0;
        sample->has_others = i % 3 == 0;
        fill(sample, i);
        check_sample(sample, file);
    }
    free(sample);
    free(file);
}

static void what_is_not_plain_is_read_too(void **state)
{
    (void)state;
    struct sample *sample = calloc(1, sizeof *sample);
    struct memory_file *file = malloc(sizeof *file);
    assert_true(sample && file);
    *sample = (struct sample){.width = 67, .height = 45, .filters = PNG_ALL_FILTERS};
    for (int i = 0; i < 3; i++) {
        sample->color_type = i == 1 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY;
        sample->interlace = i == 2 ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE;
        sample->has_transparent = i < 2;
        fill(sample, 5);
        memset(sample->pixels + 300, 7, 90);
        check_sample(sample, file);
    }
    free(sample);
    free(file);
}

/* As libpng alone reads it, told what png_codec tells it; NULL where it refuses. */
static uint8_t *read_by_libpng(struct memory_file *file, size_t size_bytes)
{
    static const png_byte names[] = "gAMA\0tEXt";
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, NULL, leave, ignore);
    png_infop info = png_create_info_struct(png);
    uint8_t *volatile pixels = NULL;
    file->at = 0;
    if (setjmp(png_jmpbuf(png))) { /* NOLINT(cert-err52-cpp): libpng's way */
        free(pixels);
        pixels = NULL;
    } else {
        png_set_read_fn(png, file, take);
#ifdef PNG_IGNORE_ADLER32 /* a newer libpng may be built without */
        png_set_option(png, PNG_IGNORE_ADLER32, PNG_OPTION_ON);
#endif
        png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, NULL, 0);
        png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, names, 2);
        png_read_info(png, info);
        png_set_expand(png);
        png_set_scale_16(png);
        png_set_gray_to_rgb(png);
        png_set_add_alpha(png, 255, PNG_FILLER_AFTER);
        int passes = png_set_interlace_handling(png);
        png_read_update_info(png, info);
        size_t row = png_get_rowbytes(png, info), height = png_get_image_height(png, info);
        assert_true(row * height <= size_bytes);
        pixels = calloc(1, size_bytes);
        assert_non_null(pixels);
        for (size_t i = 0; i < (size_t)passes * height; i++)
            png_read_row(png, pixels + i % height * row, NULL);
    }
    png_destroy_read_struct(&png, &info, NULL);
    return pixels;
}

static bool is_read_alike(struct memory_file *file, size_t size_bytes)
{
    struct image image;
    struct error err = {0};
    uint8_t *expected = read_by_libpng(file, size_bytes);
    bool is_read = png_file_decode(file->bytes, file->size, false, &image, &err);
    assert_int_equal(is_read, expected != NULL);
    if (is_read)
        assert_memory_equal(image.pixels, expected, size_bytes);
    else
        assert_int_equal(err.code, ERROR_INVALID_SCENE);
    if (is_read)
        image_finish(&image);
    free(expected);
    return is_read;
}

/* Each byte of the file in turn is another one, but for the size, which would ask for much memory;
 * and the file ends before each of them. */
static void damaged_files_are_refused_where_libpng_refuses_them(void **state)
{
    (void)state;
    struct sample *sample = calloc(1, sizeof *sample);
    struct memory_file *file = malloc(sizeof *file);
    assert_true(sample && file);
    *sample = (struct sample){.width = 19,
                              .height = 7,
                              .filters = PNG_ALL_FILTERS,
                              .color_type = PNG_COLOR_TYPE_RGB,
                              .chunk_bytes = 90,
                              .has_others = true};
    fill(sample, 1);
    write_sample(sample, file);
    size_t whole = file->size, pixel_bytes = 4 * 19 * 7, refused = 0;
    assert_true(is_read_alike(file, pixel_bytes));
    for (size_t i = 0; i < whole; i++) {
        static const uint8_t flips[] = {1, 0x20, 0x80, 0xff};
        for (size_t k = 0; k < sizeof flips && (i < 16 || i >= 24); k++) {
            file->bytes[i] ^= flips[k];
            refused += !is_read_alike(file, pixel_bytes);
            file->bytes[i] ^= flips[k];
        }
        file->size = i;
        refused += !is_read_alike(file, pixel_bytes);
        file->size = whole;
    }
    assert_true(refused > 3 * whole);
    free(sample);
    free(file);
}

/* CRC-32 of the PNG specification, annex D. */
static uint32_t crc_of(const uint8_t *bytes, size_t size)
{
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < 8 * size; i++) {
        crc ^= i % 8 ? 0 : bytes[i / 8];
        crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
    }
    return ~crc;
}

static void put_u32(uint8_t *to, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        to[i] = (uint8_t)(value >> (24 - 8 * i));
}

static void add_chunk(struct memory_file *file, const char *name, const uint8_t *data, size_t size)
{
    uint8_t *to = file->bytes + file->size;
    put_u32(to, (uint32_t)size);
    for (size_t i = 0; i < 4; i++)
        to[4 + i] = (uint8_t)name[i];
    memcpy(to + 8, data, size);
    put_u32(to + 8 + size, crc_of(to + 4, 4 + size));
    file->size += 12 + size;
}

/* 8 x 2 pixels of grey, not compressed, whose rows have these filters; `more` bytes are in the data
 * beyond its rows. */
static void write_rows(struct memory_file *file, const uint8_t filters[2], int more)
{
    static const uint8_t header[] = {0, 0, 0, 8, 0, 0, 0, 2, 8, 0, 0, 0, 0};
    uint8_t data[40] = {0x78, 1, 1}, *rows = data + 7;
    uint32_t size = (uint32_t)(18 + more), low = 1, high = 0;
    data[3] = (uint8_t)size;
    data[5] = (uint8_t)~size;
    data[6] = 0xff;
    for (uint32_t i = 0; i < size; i++) {
        rows[i] = i % 9 || i > 9 ? (uint8_t)(30 * i) : filters[i / 9];
        low = (low + rows[i]) % 65521; /* Adler-32, RFC 1950 */
        high = (high + low) % 65521;
    }
    put_u32(rows + size, high << 16 | low);
    memcpy(file->bytes, "\x89PNG\r\n\x1a\n", 8);
    file->size = 8;
    add_chunk(file, "IHDR", header, sizeof header);
    add_chunk(file, "IDAT", data, 11 + size);
    add_chunk(file, "IEND", data, 0);
}

static void sound_data_of_unsound_rows_is_refused_likewise(void **state)
{
    (void)state;
    struct memory_file *file = malloc(sizeof *file);
    assert_non_null(file);
    for (int i = 0; i < 256; i++) {
        const uint8_t filters[] = {(uint8_t)(i % 2 ? i / 2 : 1), (uint8_t)(i % 2 ? 4 : i / 2)};
        write_rows(file, filters, 0);
        assert_int_equal(is_read_alike(file, 64), i / 2 <= 4);
    }
    for (int more = -18; more < 8; more++) {
        write_rows(file, (const uint8_t[]){2, 3}, more);
        assert_int_equal(is_read_alike(file, 64), more >= 0);
    }
    free(file);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pixels_come_back_as_they_were_written),
        cmocka_unit_test(what_is_not_plain_is_read_too),
        cmocka_unit_test(damaged_files_are_refused_where_libpng_refuses_them),
        cmocka_unit_test(sound_data_of_unsound_rows_is_refused_likewise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

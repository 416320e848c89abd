/* SPDX-License-Identifier: MIT */
/* TGA and BMP in all forms that are read, written out here from one picture; each cut off anywhere
 * is refused, and each with bytes changed ends in a picture or in a refusal. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

#include "renderer/image/image.h"
#include "renderer/image/image_header.h"

enum { WIDTH = 5, HEIGHT = 3, COUNT = WIDTH * HEIGHT, BYTES_MOST = 4096 };

/* Few colours, whose channels are the same in 5 bits, and green in 6 bits. */
static const uint8_t colors[4][4] = {
    {255, 0, 0, 255}, {0, 49, 255, 255}, {8, 16, 25, 255}, {255, 255, 255, 128}};
/* Runs of one colour, across ends of rows. */
static const int picture[COUNT] = {0, 0, 0, 1, 2, 2, 2, 2, 2, 3, 1, 0, 3, 3, 3};

struct file {
    uint8_t bytes[BYTES_MOST];
    size_t size;
};

static void put(struct file *file, uint64_t number, int bytes)
{
    for (int i = 0; i < bytes; i++)
        file->bytes[file->size++] = (uint8_t)(number >> 8 * i);
}

/* ---- TGA ---- */

struct tga_form {
    int type, bits; /* of the file's pixels */
    int palette_bits, order;
};

static void put_color(struct file *file, const uint8_t color[4], int bits)
{
    if (bits <= 16) {
        put(file, (uint32_t)(color[0] >> 3) << 10 | (uint32_t)(color[1] >> 3) << 5 | color[2] >> 3,
            2);
        return;
    }
    put(file, color[2], 1);
    put(file, color[1], 1);
    put(file, color[0], 1);
    if (bits == 32)
        put(file, color[3], 1);
}

static void put_tga_pixel(struct file *file, const struct tga_form *form, int color)
{
    enum { FIRST_ENTRY = 2 };
    int kind = form->type & 7;
    if (kind == 1)
        put(file, (uint32_t)(color + FIRST_ENTRY), form->bits / 8);
    else if (kind == 2)
        put_color(file, colors[color], form->bits);
    else
        put(file, colors[color][1] | (form->bits == 16 ? (uint32_t)colors[color][3] << 8 : 0),
            form->bits / 8);
}

/* The colour of the file's pixel with that number. */
static int color_at(int number, int order)
{
    int x = number % WIDTH, y = number / WIDTH;
    if (order & 0x10)
        x = WIDTH - 1 - x;
    if (!(order & 0x20))
        y = HEIGHT - 1 - y;
    return picture[y * WIDTH + x];
}

static void make_tga(struct file *file, const struct tga_form *form)
{
    bool has_palette = (form->type & 7) == 1;
    const uint32_t head[][2] = {{3, 1}, /* a comment */
                                {has_palette, 1},
                                {(uint32_t)form->type, 1},
                                {has_palette ? 2 : 0, 2},
                                {has_palette ? 4 : 0, 2},
                                {(uint32_t)form->palette_bits, 1},
                                {0, 4},
                                {WIDTH, 2},
                                {HEIGHT, 2},
                                {(uint32_t)form->bits, 1},
                                {(uint32_t)form->order, 1},
                                {0x616161, 3}};
    file->size = 0;
    for (size_t i = 0; i < sizeof head / sizeof *head; i++)
        put(file, head[i][0], (int)head[i][1]);
    for (int i = 0; has_palette && i < 4; i++)
        put_color(file, colors[i], form->palette_bits);
    for (int i = 0, count; i < COUNT; i += count) {
        int first = color_at(i, form->order);
        count = 1;
        if (!(form->type & 8)) {
            put_tga_pixel(file, form, first);
            continue;
        }
        while (i + count < COUNT && color_at(i + count, form->order) == first)
            count++;
        if (count > 1)
            put(file, 0x80u | (uint32_t)(count - 1), 1);
        else
            put(file, 0, 1);
        put_tga_pixel(file, form, first);
    }
}

/* ---- BMP ---- */

struct bmp_form {
    int bits, header, compression;
    bool is_from_top;
    uint32_t masks[4];
};

static void put_bmp_row(struct file *file, const struct bmp_form *form, const int *row)
{
    size_t begin = file->size;
    uint32_t packed = 0;
    for (int x = 0; x < WIDTH; x++) {
        const uint8_t *color = colors[row[x]];
        if (form->bits <= 8) {
            packed = packed << form->bits | (uint32_t)(row[x] & ((1 << form->bits) - 1));
            if ((x + 1) * form->bits % 8 == 0) {
                put(file, packed, 1);
                packed = 0;
            }
        } else if (form->bits == 24) {
            put_color(file, color, 24);
        } else if (form->masks[0] == 0xFF) { /* R, G, B, A */
            put(file,
                color[0] | (uint32_t)color[1] << 8 | (uint32_t)color[2] << 16 |
                    (uint32_t)color[3] << 24,
                4);
        } else if (form->masks[1] == 0x7E0) {
            put(file,
                (uint32_t)(color[0] >> 3) << 11 | (uint32_t)(color[1] >> 2) << 5 | color[2] >> 3,
                2);
        } else {
            put_color(file, color, form->bits == 32 ? 24 : 16);
            if (form->bits == 32)
                put(file, 0, 1); /* says nothing */
        }
    }
    if (form->bits <= 8 && WIDTH * form->bits % 8)
        put(file, packed << (8 - WIDTH * form->bits % 8), 1);
    while ((file->size - begin) % 4)
        put(file, 0, 1);
}

static void put_bmp_runs(struct file *file, const struct bmp_form *form, const int *row)
{
    static const int absolute = 4; /* pixels that the second row begins with */
    int x = 0;
    if (row == picture + WIDTH) {
        put(file, (uint32_t)absolute << 8, 2);
        for (; x < absolute; x += form->bits == 4 ? 2 : 1)
            put(file,
                form->bits == 4 ? (uint32_t)row[x] << 4 | (uint32_t)row[x + 1] : (uint32_t)row[x],
                1);
    }
    for (int count; x < WIDTH; x += count) {
        for (count = 1; x + count < WIDTH && row[x + count] == row[x];)
            count++;
        put(file, (uint32_t)count, 1);
        put(file, (uint32_t)row[x] * (form->bits == 4 ? 0x11u : 1u), 1);
    }
    put(file, 0, 2);
}

static void make_bmp(struct file *file, const struct bmp_form *form)
{
    bool is_core = form->header == 12;
    int entries = form->bits <= 8 ? 1 << form->bits : 0;
    size_t pixels = 14 + (size_t)form->header + (size_t)entries * (is_core ? 3 : 4) +
                    (form->compression == 3 && form->header == 40 ? 12 : 0);
    *file = (struct file){.size = 0};
    put(file, 'B' | 'M' << 8, 2);
    put(file, 0, 8);
    put(file, (uint32_t)pixels, 4);
    put(file, (uint32_t)form->header, 4);
    put(file, WIDTH, is_core ? 2 : 4);
    put(file, form->is_from_top ? (uint32_t)-HEIGHT : HEIGHT, is_core ? 2 : 4);
    put(file, 1, 2);
    put(file, (uint32_t)form->bits, 2);
    if (!is_core) {
        put(file, (uint32_t)form->compression, 4);
        file->size = 14 + 40;
    }
    for (int i = 0; form->compression == 3 && i < (form->header > 40 ? 4 : 3); i++)
        put(file, form->masks[i], 4);
    file->size = pixels - (size_t)entries * (is_core ? 3 : 4);
    for (int i = 0; i < entries; i++) {
        put_color(file, colors[i % 4], 24);
        if (!is_core)
            put(file, 0, 1);
    }
    for (int y = 0; y < HEIGHT; y++) {
        const int *row = picture + WIDTH * (form->is_from_top ? y : HEIGHT - 1 - y);
        if (form->compression == 1 || form->compression == 2)
            put_bmp_runs(file, form, row);
        else
            put_bmp_row(file, form, row);
    }
    if (form->compression == 1 || form->compression == 2)
        put(file, 0x0100, 2);
}

/* ---- expectations ---- */

static bool decode(const struct file *file, size_t size, struct image *image, struct error *err)
{
    const struct image_decode_desc desc = {.takes_old = true, .max_pixels = 1 << 16};
    uint8_t *copy = malloc(size ? size : 1); /* so that a sanitizer sees what is read beyond */
    memcpy(copy, file->bytes, size);
    bool is_good = image_decode(copy, size, &desc, image, err);
    free(copy);
    return is_good;
}

/* color_count: 2 where the picture has its colours modulo 2. */
static void expect_picture(const struct file *file, bool is_grey, bool has_alpha, int color_count,
                           int form)
{
    struct image image;
    struct error err = {0};
    if (!decode(file, file->size, &image, &err))
        fail_msg("form %d: %s", form, err.message);
    assert_int_equal(image.width_px, WIDTH);
    assert_int_equal(image.height_px, HEIGHT);
    for (int i = 0; i < COUNT; i++) {
        const uint8_t *found = (const uint8_t *)image.pixels + 4 * i;
        const uint8_t *color = colors[picture[i] % color_count];
        for (int k = 0; k < 4; k++) {
            int expected = k == 3 ? (has_alpha ? color[3] : 255) : color[is_grey ? 1 : k];
            if (found[k] != expected)
                fail_msg("form %d, pixel %d, channel %d: %d, expected %d", form, i, k, found[k],
                         expected);
        }
    }
    image_finish(&image);
}

/* Every length but the whole; `tail`: bytes at the end that the picture is whole without. */
static void expect_cuts_refused(const struct file *file, size_t tail, int form)
{
    for (size_t size = 0; size + tail < file->size; size++) {
        struct image image;
        struct error err = {0};
        if (decode(file, size, &image, &err))
            fail_msg("form %d: %zu of %zu bytes are taken", form, size, file->size);
        assert_true(err.code == ERROR_INVALID_SCENE || err.code == ERROR_UNSUPPORTED ||
                    err.code == ERROR_TOO_LARGE);
        assert_null(image.pixels);
    }
}

static void expect_no_crash(const struct file *file)
{
    for (size_t i = 0; i < file->size; i++)
        for (int value = 0; value < 256; value += 15) {
            struct file changed = *file;
            struct image image;
            struct error err = {0};
            changed.bytes[i] = (uint8_t)value;
            if (decode(&changed, changed.size, &image, &err))
                image_finish(&image);
            else
                assert_int_not_equal(err.code, ERROR_INTERNAL);
        }
}

static void every_form_of_tga_is_read(void **state)
{
    (void)state;
    static const struct tga_form forms[] = {
        {1, 8, 24, 0},     {1, 8, 32, 0x20}, {1, 16, 16, 0x20}, {2, 16, 0, 0},     {2, 24, 0, 0},
        {2, 24, 0, 0x20},  {2, 24, 0, 0x10}, {2, 24, 0, 0x30},  {2, 32, 0, 0x28},  {3, 8, 0, 0x20},
        {3, 16, 0, 0},     {9, 8, 24, 0},    {9, 8, 32, 0x30},  {10, 16, 0, 0x20}, {10, 24, 0, 0},
        {10, 32, 0, 0x38}, {11, 8, 0, 0x20}, {11, 16, 0, 0x10},
    };
    for (int i = 0; i < (int)(sizeof forms / sizeof *forms); i++) {
        const struct tga_form *form = &forms[i];
        struct file file;
        int kind = form->type & 7;
        make_tga(&file, form);
        expect_picture(&file, kind == 3,
                       kind == 1 ? form->palette_bits == 32 : form->bits == (kind == 2 ? 32 : 16),
                       4, i);
        expect_cuts_refused(&file, 0, i);
        expect_no_crash(&file);
    }
}

static void every_form_of_bmp_is_read(void **state)
{
    (void)state;
    static const struct bmp_form forms[] = {
        {24, 12, 0, false, {0}},
        {8, 12, 0, false, {0}},
        {1, 40, 0, false, {0}},
        {4, 40, 0, true, {0}},
        {8, 40, 0, false, {0}},
        {16, 40, 0, false, {0}},
        {24, 40, 0, true, {0}},
        {32, 40, 0, false, {0}},
        {16, 40, 3, false, {0xF800, 0x7E0, 0x1F}},
        {32, 40, 3, false, {0xFF, 0xFF00, 0xFF0000}},
        {32, 108, 3, true, {0xFF, 0xFF00, 0xFF0000, 0xFF000000}},
        {32, 124, 3, false, {0xFF, 0xFF00, 0xFF0000, 0xFF000000}},
        {8, 40, 1, false, {0}},
        {4, 40, 2, false, {0}},
    };
    for (int i = 0; i < (int)(sizeof forms / sizeof *forms); i++) {
        const struct bmp_form *form = &forms[i];
        struct file file;
        bool has_runs = form->compression == 1 || form->compression == 2;
        make_bmp(&file, form);
        expect_picture(&file, false, form->masks[3] != 0, form->bits == 1 ? 2 : 4, i);
        expect_cuts_refused(&file, has_runs ? 4 : 0, i); /* ends of the last row and the image */
        expect_no_crash(&file);
    }
}

static void alpha_that_is_nowhere_was_not_meant(void **state)
{
    (void)state;
    struct file file;
    struct image image;
    make_tga(&file, &(struct tga_form){2, 32, 0, 0});
    for (size_t i = 21 + 3; i < file.size; i += 4)
        file.bytes[i] = 0;
    assert_true(decode(&file, file.size, &image, NULL));
    for (int i = 0; i < COUNT; i++)
        assert_int_equal(((const uint8_t *)image.pixels)[4 * i + 3], 255);
    image_finish(&image);
}

static void gltf_has_neither(void **state)
{
    (void)state;
    struct file file;
    struct image image;
    struct error err = {0};
    make_bmp(&file, &(struct bmp_form){.bits = 24, .header = 40});
    assert_false(image_decode(file.bytes, file.size,
                              &(struct image_decode_desc){.takes_old = false}, &image, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    make_tga(&file, &(struct tga_form){2, 24, 0, 0});
    err = (struct error){0};
    assert_false(image_decode(file.bytes, file.size,
                              &(struct image_decode_desc){.takes_old = false}, &image, &err));
    assert_int_equal(err.code, ERROR_INVALID_SCENE);
}

/* 16,000 x 16,000 pixels of runs in a hundred bytes, and of 32 bits in none. */
static void sizes_that_lie_are_refused_before_anything_is_taken(void **state)
{
    (void)state;
    struct file file;
    struct image_header header;
    make_tga(&file, &(struct tga_form){10, 24, 0, 0});
    memcpy(file.bytes + 12, (const uint8_t[]){0x80, 0x3E, 0x80, 0x3E}, 4);
    assert_false(image_header_read_old(&header, file.bytes, file.size, NULL));
    for (int runs = 0; runs < 2; runs++) {
        make_bmp(&file,
                 &(struct bmp_form){.bits = runs ? 8 : 32, .header = 40, .compression = runs});
        memcpy(file.bytes + 18, (const uint8_t[]){0x80, 0x3E, 0, 0, 0x80, 0x3E, 0, 0}, 8);
        assert_false(image_header_read_old(&header, file.bytes, file.size, NULL));
        memcpy(file.bytes + 18, (const uint8_t[]){255, 255, 255, 127, 255, 255, 255, 127}, 8);
        assert_false(image_header_read_old(&header, file.bytes, file.size, NULL));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_form_of_tga_is_read),
        cmocka_unit_test(every_form_of_bmp_is_read),
        cmocka_unit_test(alpha_that_is_nowhere_was_not_meant),
        cmocka_unit_test(gltf_has_neither),
        cmocka_unit_test(sizes_that_lie_are_refused_before_anything_is_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

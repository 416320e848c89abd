/* SPDX-License-Identifier: MIT */
/* Blocks of opaque images: sizes, colours that blocks hold exactly, edges, and the error that is
 * told. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/textures/texture_blocks.h"

enum { BC1_BYTES = 8, BC3_BYTES = 16 };

static void sizes_count_whole_blocks(void **state)
{
    (void)state;
    assert_int_equal(texture_blocks_bytes(16, 16, 0, false), 8 * (16 + 4 + 1 + 1 + 1));
    assert_int_equal(texture_blocks_bytes(16, 16, 1, false), 8 * (4 + 1 + 1 + 1));
    assert_int_equal(texture_blocks_bytes(5, 3, 0, false), 8 * (2 + 1 + 1));
    assert_int_equal(texture_blocks_bytes(5, 3, 3, false), 0);
    assert_int_equal(texture_blocks_bytes(5, 3, 0, true), 16 * (2 + 1 + 1));
}

static void fill(uint8_t *rgba, int count, const uint8_t color[3])
{
    for (int i = 0; i < count; i++) {
        memcpy(rgba + 4 * i, color, 3);
        rgba[4 * i + 3] = 255;
    }
}

/* What five and six bits hold; and an odd size, whose last blocks hang over. */
static void colours_of_the_format_are_exact(void **state)
{
    (void)state;
    uint8_t rgba[4 * 7 * 5], blocks[2 * 2 * BC1_BYTES];
    double squares = 0;
    fill(rgba, 7 * 5, (uint8_t[3]){0, 255, 132});
    texture_blocks_encode(rgba, 7, 5, false, blocks, &squares);
    assert_true(squares == 0);
    for (int i = 1; i < 4; i++)
        assert_memory_equal(blocks, blocks + (size_t)i * BC1_BYTES, BC1_BYTES);
}

/* Black and white alone in a block are its two ends. */
static void two_colours_are_exact(void **state)
{
    (void)state;
    uint8_t rgba[64], blocks[BC1_BYTES];
    double squares = 0;
    for (int i = 0; i < 16; i++)
        fill(rgba + 4 * (size_t)i, 1, i % 3 ? (uint8_t[3]){255, 255, 255} : (uint8_t[3]){0, 0, 0});
    texture_blocks_encode(rgba, 4, 4, false, blocks, &squares);
    assert_true(squares == 0);
}

/* Red against blue over green: no line through the three holds them. */
static void what_no_line_holds_has_an_error(void **state)
{
    (void)state;
    static const uint8_t colors[3][3] = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}};
    uint8_t rgba[64], blocks[BC1_BYTES];
    double squares = 0;
    for (int i = 0; i < 16; i++)
        fill(rgba + 4 * (size_t)i, 1, colors[i % 3]);
    texture_blocks_encode(rgba, 4, 4, false, blocks, &squares);
    assert_true(squares > 5. * 100 * 100); /* one of three colours, at the least */
    assert_true(squares < 16. * 3 * 255 * 255);
}

/* A ramp of 16 steps of 2: ends within a step of five bits, and two colours between them. */
static void a_ramp_is_near(void **state)
{
    (void)state;
    uint8_t rgba[64], blocks[BC1_BYTES];
    double squares = 0;
    for (int i = 0; i < 16; i++) {
        uint8_t v = (uint8_t)(100 + 2 * i);
        fill(rgba + 4 * (size_t)i, 1, (uint8_t[3]){v, v, v});
    }
    texture_blocks_encode(rgba, 4, 4, false, blocks, &squares);
    assert_true(squares > 0 && squares < 16. * 3 * 8 * 8);
}

/* A mask keeps its texels; so does a block with one value between. */
static void alpha_of_masks_is_exact(void **state)
{
    (void)state;
    uint8_t rgba[64], blocks[BC3_BYTES];
    for (int middle = 0; middle < 256; middle += 51) {
        double squares = 0;
        fill(rgba, 16, (uint8_t[3]){0, 255, 132});
        for (int i = 0; i < 16; i++)
            rgba[4 * i + 3] = (uint8_t)(i % 5 == 0 ? 0 : i % 3 ? 255 : middle / 51 * 51);
        texture_blocks_encode(rgba, 4, 4, true, blocks, &squares);
        assert_true(squares <= 16. * 19 * 19); /* half of a seventh of 255, of some */
        if (middle == 0 || middle == 255)
            assert_true(squares == 0);
    }
}

/* A ramp from 0 to 255 in steps of 17 falls between eight values; what is told is what a decoder of
 * its own finds. */
static void the_error_of_alpha_is_reported(void **state)
{
    (void)state;
    uint8_t rgba[64], blocks[BC3_BYTES];
    double squares = 0, expected = 0;
    fill(rgba, 16, (uint8_t[3]){255, 255, 255});
    for (int i = 0; i < 16; i++)
        rgba[4 * i + 3] = (uint8_t)(17 * i);
    texture_blocks_encode(rgba, 4, 4, true, blocks, &squares);
    assert_int_equal(blocks[0], 255);
    assert_int_equal(blocks[1], 0);
    for (int i = 0; i < 16; i++) { /* the nearest of eight is at most 255 / 14 away */
        double nearest = 1e9;
        for (int k = 0; k < 8; k++) {
            double away = (255 * k + 3) / 7 - 17 * i;
            nearest = away * away < nearest ? away * away : nearest;
        }
        expected += nearest;
    }
    assert_true(squares >= expected && squares < 1.5 * expected);
    squares = 0;
    texture_blocks_encode(rgba, 4, 4, false, blocks, &squares);
    assert_true(squares == 0); /* taken as opaque white */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sizes_count_whole_blocks),
        cmocka_unit_test(colours_of_the_format_are_exact),
        cmocka_unit_test(two_colours_are_exact),
        cmocka_unit_test(what_no_line_holds_has_an_error),
        cmocka_unit_test(a_ramp_is_near),
        cmocka_unit_test(alpha_of_masks_is_exact),
        cmocka_unit_test(the_error_of_alpha_is_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

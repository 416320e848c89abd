/* SPDX-License-Identifier: MIT */
/* Pictures cut into tiles: each pixel is in one tile, and none is larger than asked for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "protocol/picture_tiles.h"

static void tiles_cover_the_picture_once(void **state)
{
    static const struct {
        int width, height, tile_width, tile_height, columns, rows;
    } cases[] = {
        {1, 1, 256, 256, 1, 1},
        {256, 257, 256, 256, 1, 2},
        {700, 530, 256, 256, 4, 4},
        {40000, 30000, 2048, 2048, 32, 16},
        {65536, 65535, 512, 16384, 128, 4},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct picture_tiles tiles = picture_tiles_make(
            cases[i].width, cases[i].height, cases[i].tile_width, cases[i].tile_height);
        assert_int_equal(tiles.columns, cases[i].columns);
        assert_int_equal(tiles.rows, cases[i].rows);
        int y = 0;
        for (int row = 0; row < tiles.rows; row++) {
            int x = 0, height = picture_tiles_get(&tiles, row * tiles.columns).height;
            for (int column = 0; column < tiles.columns; column++) {
                const struct request_tile tile =
                    picture_tiles_get(&tiles, row * tiles.columns + column);
                assert_int_equal(tile.x, x);
                assert_int_equal(tile.y, y);
                assert_int_equal(tile.height, height);
                assert_in_range(tile.width, 1, cases[i].tile_width);
                assert_in_range(tile.height, 1, cases[i].tile_height);
                x += tile.width;
            }
            assert_int_equal(x, cases[i].width);
            y += height;
        }
        assert_int_equal(y, cases[i].height);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_cover_the_picture_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

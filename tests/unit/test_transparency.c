/* SPDX-License-Identifier: MIT */
/* The rows of the methods of drawing transparent surfaces, and what is made of them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/transparency.h"

static void every_row_has_a_name_of_its_own_and_a_sentence(void **state)
{
    (void)state;
    for (int i = 0; i < TRANSPARENCIES_COUNT; i++) {
        const struct transparency_row *row = &transparency_rows[i];
        assert_string_equal(row->name, transparency_name(i));
        assert_true(strlen(row->sentence) > 20);
        for (int k = 0; k < i; k++)
            assert_string_not_equal(row->name, transparency_name(k));
    }
}

static void numbers_beyond_the_rows_have_no_name(void **state)
{
    (void)state;
    assert_null(transparency_name(-1));
    assert_null(transparency_name(TRANSPARENCIES_COUNT));
}

static void each_bit_of_a_row_has_a_name(void **state)
{
    (void)state;
    unsigned can = 0;
    for (int i = 0; i < TRANSPARENCIES_COUNT; i++)
        can |= transparency_rows[i].can;
    assert_int_equal(can, TRANSPARENCY_CAN_ALL);
    for (int bit = 0; bit < 32; bit++)
        assert_int_equal(transparency_can_name(bit) != NULL, (can >> bit & 1) != 0);
}

static void help_texts_name_them_all(void **state)
{
    (void)state;
    assert_int_equal(0, strncmp(TRANSPARENCY_NAMES, "auto, lists", 11));
    assert_non_null(strstr(TRANSPARENCY_NAMES, transparency_name(TRANSPARENCIES_COUNT - 1)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_row_has_a_name_of_its_own_and_a_sentence),
        cmocka_unit_test(numbers_beyond_the_rows_have_no_name),
        cmocka_unit_test(each_bit_of_a_row_has_a_name),
        cmocka_unit_test(help_texts_name_them_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

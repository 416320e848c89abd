/* SPDX-License-Identifier: MIT */
/* Errors: the table is complete, the first error wins, texts stay UTF-8 and within their buffers.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/error.h"
#include "protocol/utf8.h"

static bool is_utf8(const char *text)
{
    while (*text) {
        size_t bytes = utf8_sequence_bytes(text);
        if (bytes == 0)
            return false;
        text += bytes;
    }
    return true;
}

static void every_code_has_name_title_and_status(void **state)
{
    (void)state;
    for (int code = 0; code < ERROR_CODE_COUNT; code++) {
        const char *name = error_code_name((enum error_code)code);
        assert_non_null(name);
        assert_non_null(error_code_title((enum error_code)code));
        assert_int_equal(error_code_from_name(name), code);
        int status = error_code_http_status((enum error_code)code);
        assert_true(code == ERROR_NONE ? status == 200 : status >= 400 && status <= 599);
    }
}

static void names_are_unique(void **state)
{
    (void)state;
    for (int a = 0; a < ERROR_CODE_COUNT; a++)
        for (int b = a + 1; b < ERROR_CODE_COUNT; b++)
            assert_string_not_equal(error_code_name((enum error_code)a),
                                    error_code_name((enum error_code)b));
}

static void unknown_codes_and_names_are_internal(void **state)
{
    (void)state;
    assert_string_equal(error_code_name((enum error_code)999), "internal");
    assert_int_equal(error_code_http_status((enum error_code)999), 500);
    assert_int_equal(error_code_from_name("no_such_code"), ERROR_INTERNAL);
    assert_int_equal(error_code_from_name(NULL), ERROR_INTERNAL);
}

static void first_error_wins(void **state)
{
    (void)state;
    struct error err = {0};
    assert_false(error_set_at(&err, ERROR_TOO_LARGE, "/lights", "first %d", 1));
    assert_false(error_set(&err, ERROR_INTERNAL, "second"));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
    assert_string_equal(err.message, "first 1");
    assert_string_equal(err.pointer, "/lights");
}

static void null_error_is_accepted(void **state)
{
    (void)state;
    assert_false(error_set(NULL, ERROR_INTERNAL, "x"));
    assert_false(error_set_at(NULL, ERROR_INTERNAL, "/a", "x"));
    assert_false(error_wrap(NULL, "x"));
}

static void wrap_puts_context_in_front_of_a_set_error_only(void **state)
{
    (void)state;
    struct error err = {0};
    assert_false(error_wrap(&err, "scene"));
    assert_string_equal(err.message, "");
    (void)error_set(&err, ERROR_NOT_FOUND, "node 7");
    (void)error_wrap(&err, "scene '%s'", "a");
    assert_string_equal(err.message, "scene 'a': node 7");
    assert_int_equal(err.code, ERROR_NOT_FOUND);
}

static void wrap_with_long_context_keeps_the_cause(void **state)
{
    (void)state;
    char context[1000];
    memset(context, 'c', sizeof context - 1);
    context[sizeof context - 1] = '\0';
    struct error err = {0};
    (void)error_set(&err, ERROR_IO, "the cause");
    (void)error_wrap(&err, "%s", context);
    assert_non_null(strstr(err.message, ": the cause"));
}

/* Shifts a text of multi-byte characters byte by byte over the end of the buffer. */
static void long_messages_end_at_a_character(void **state)
{
    (void)state;
    static const char *const characters[] = {"\xC3\xA9", "\xE2\x82\xAC", "\xF0\x9F\x8C\x88"};
    for (size_t c = 0; c < 3; c++) {
        for (size_t shift = 0; shift < 8; shift++) {
            char text[2 * ERROR_MESSAGE_BYTES] = "";
            memset(text, 'a', shift);
            while (strlen(text) < sizeof text - 8)
                strcat(text, characters[c]);
            struct error err = {0};
            (void)error_set(&err, ERROR_INTERNAL, "%s", text);
            assert_true(is_utf8(err.message));
            assert_null(strchr(err.message, '?'));
            assert_true(strlen(err.message) + 4 >= ERROR_MESSAGE_BYTES);
            (void)error_wrap(&err, "%s", text);
            assert_true(is_utf8(err.message));
            assert_null(strchr(err.message, '?'));
        }
    }
}

static void stray_bytes_and_control_characters_become_question_marks(void **state)
{
    (void)state;
    struct error err = {0};
    (void)error_set(&err, ERROR_INTERNAL,
                    "a\xFF"
                    "b\xC3"
                    "c\n\xED\xA0\x80");
    assert_string_equal(err.message, "a?b?c????");
}

static void long_pointers_name_an_enclosing_member(void **state)
{
    (void)state;
    char pointer[400] = "/overrides/nodes/";
    memset(pointer + strlen(pointer), 'n', 300);
    struct error err = {0};
    (void)error_set_at(&err, ERROR_INVALID_REQUEST, pointer, "x");
    assert_string_equal(err.pointer, "/overrides/nodes");
}

static void copy_never_cuts_a_character(void **state)
{
    (void)state;
    char buffer[6];
    utf8_copy(buffer, sizeof buffer, "abc\xE2\x82\xAC");
    assert_string_equal(buffer, "abc");
    utf8_copy(buffer, sizeof buffer, "ab\xE2\x82\xAC");
    assert_string_equal(buffer, "ab\xE2\x82\xAC");
    utf8_copy(buffer, 1, "ab");
    assert_string_equal(buffer, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_code_has_name_title_and_status),
        cmocka_unit_test(names_are_unique),
        cmocka_unit_test(unknown_codes_and_names_are_internal),
        cmocka_unit_test(first_error_wins),
        cmocka_unit_test(null_error_is_accepted),
        cmocka_unit_test(wrap_puts_context_in_front_of_a_set_error_only),
        cmocka_unit_test(wrap_with_long_context_keeps_the_cause),
        cmocka_unit_test(long_messages_end_at_a_character),
        cmocka_unit_test(stray_bytes_and_control_characters_become_question_marks),
        cmocka_unit_test(long_pointers_name_an_enclosing_member),
        cmocka_unit_test(copy_never_cuts_a_character),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

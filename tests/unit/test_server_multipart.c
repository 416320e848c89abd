/* SPDX-License-Identifier: MIT */
/* The multipart parser: the same parts however the body is cut, and a reason for every refusal. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/http/multipart.h"

/* What came out, as text: "[name|filename]data;" for each part. */
struct record {
    char text[4096];
    size_t length;
};

static void note(struct record *record, const void *bytes, size_t size_bytes)
{
    assert_true(record->length + size_bytes < sizeof record->text);
    memcpy(record->text + record->length, bytes, size_bytes);
    record->length += size_bytes;
    record->text[record->length] = '\0';
}

static bool on_part(void *context, const struct multipart_part *part, struct error *err)
{
    (void)err;
    char head[512];
    note(context, head, (size_t)snprintf(head, sizeof head, "[%s|%s]", part->name, part->filename));
    return true;
}

static bool on_data(void *context, const void *bytes, size_t size_bytes, struct error *err)
{
    (void)err;
    assert_true(size_bytes > 0);
    note(context, bytes, size_bytes);
    return true;
}

static bool on_end(void *context, struct error *err)
{
    (void)err;
    note(context, ";", 1);
    return true;
}

/* Parses a body in pieces of `first` bytes, then one of the rest, then byte by byte when first is
 * 0. */
static bool parse(const char *type, const char *body, size_t size_bytes, size_t first,
                  struct record *record, struct error *err)
{
    *record = (struct record){0};
    const struct multipart_events events = {record, on_part, on_data, on_end};
    struct multipart *multipart = multipart_create(type, &events, err);
    if (!multipart)
        return false;
    bool is_good = true;
    for (size_t at = 0; is_good && at < size_bytes && first == 0; at++)
        is_good = multipart_write(multipart, body + at, 1, err);
    if (first > 0) {
        char *head = malloc(first), *tail = malloc(size_bytes - first + 1);
        memcpy(head, body, first); /* copies, so that a sanitizer sees reads beyond a piece */
        memcpy(tail, body + first, size_bytes - first);
        is_good = multipart_write(multipart, head, first, err) &&
                  multipart_write(multipart, tail, size_bytes - first, err);
        free(head);
        free(tail);
    }
    is_good = is_good && multipart_end(multipart, err);
    multipart_destroy(multipart);
    return is_good;
}

static const char TYPE[] = "multipart/form-data; charset=x; boundary=\"a-b\"";

static void the_same_parts_come_out_however_the_body_is_cut(void **state)
{
    (void)state;
    /* Data that looks like boundaries; an empty part; a part that ends in CR; a preamble and an
     * epilogue. */
    static const char body[] =
        "pre\r\namble\r\n--a-b\r\n"
        "Content-Disposition: form-data; name=\"one\"; filename=\"x/y z.bin\"\r\n"
        "Content-Type: a/b\r\n\r\n"
        "\r\n--a-\r\n--a-c\r\r\n-\r\n--\r\n--a-b \t\r\n"
        "content-disposition:form-data; filename=\"q\\\"%22.bin\"; name=two\r\n\r\n"
        "\r\n--a-b\r\n"
        "Content-Disposition: form-data; name=\"three\"\r\n\r\n"
        "a--a-b is data here\r\n\r\r\n--a-b--\r\nepi\r\n--a-b\r\nlogue";
    static const char expected[] = "[one|x/y z.bin]\r\n--a-\r\n--a-c\r\r\n-\r\n--;"
                                   "[two|q\"\".bin];[three|]a--a-b is data here\r\n\r;";
    for (size_t cut = 0; cut < sizeof body - 1; cut++) {
        struct record record;
        struct error err = {0};
        if (!parse(TYPE, body, sizeof body - 1, cut, &record, &err))
            fail_msg("cut at %zu: %s", cut, err.message);
        if (strcmp(expected, record.text) != 0)
            fail_msg("cut at %zu: %s", cut, record.text);
    }
}

static void random_data_comes_out_as_it_went_in(void **state)
{
    (void)state;
    static const char letters[] = "\r\n-ab";
    unsigned seed = 7;
    for (int round = 0; round < 3000; round++) {
        char body[400], data[200];
        size_t length = (size_t)(rand_r(&seed) % 120);
        for (size_t i = 0; i < length; i++)
            data[i] = letters[rand_r(&seed) % 5];
        data[length] = '\0';
        if (strstr(data, "\r\n--a-b") || strncmp(data, "--a-b", 5) == 0)
            continue;
        int size =
            snprintf(body, sizeof body,
                     "--a-b\r\nContent-Disposition: form-data; name=n\r\n\r\n%s\r\n--a-b--", data);
        struct record record;
        struct error err = {0};
        size_t cut = (size_t)(rand_r(&seed) % size);
        assert_true(parse(TYPE, body, (size_t)size, cut, &record, &err));
        assert_int_equal(length + 5, record.length);
        assert_memory_equal(data, record.text + 4, length);
    }
}

static void every_refusal_has_a_reason(void **state)
{
    (void)state;
    static const struct {
        const char *type, *body, *part;
    } table[] = {
        {"multipart/form-data", "", "without a boundary"},
        {"multipart/form-data; boundary=", "", "without a boundary"},
        {"multipart/form-data; boundary=\"\"", "", "without a boundary"},
        {TYPE, "", "closing boundary"},
        {TYPE, "--a-b\r\n", "closing boundary"},
        {TYPE, "--a-b\r\nContent-Disposition: form-data\r\n\r\nx", "closing boundary"},
        {TYPE, "--a-bxx", "neither CRLF"},
        {TYPE, "--a-b-x", "neither CRLF"},
        {TYPE, "--a-b\r\n\r\n", "no Content-Disposition"},
        {TYPE, "--a-b\r\nX: y\r\n\r\n", "no Content-Disposition"},
        {TYPE, "--a-b\r\nContent-Disposition: inline\r\n", "not form-data"},
        {TYPE, "--a-b\r\nX: y\nZ: w\r\n", "does not end in CRLF"},
        {TYPE, "--a-b\r\nContent-Disposition: form-data\r\nContent-Disposition: form-data\r\n\r\n",
         "two Content-Disposition"},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        struct record record;
        struct error err = {0};
        assert_false(parse(table[i].type, table[i].body, strlen(table[i].body), 0, &record, &err));
        assert_int_equal(ERROR_INVALID_REQUEST, err.code);
        if (!strstr(err.message, table[i].part))
            fail_msg("'%s' does not say '%s'", err.message, table[i].part);
    }
}

static void headers_without_end_are_cut_off(void **state)
{
    (void)state;
    char *body = malloc(1 << 20);
    struct record record;
    struct error err = {0};
    memcpy(body, "--a-b\r\n", 7);
    memset(body + 7, 'x', (1 << 20) - 7);
    assert_false(parse(TYPE, body, 1 << 20, 100, &record, &err));
    assert_non_null(strstr(err.message, "header line over"));
    size_t at = 7;
    for (int i = 0; i < 100; i++, at += 6)
        memcpy(body + at, "X: y\r\n", 6);
    err = (struct error){0};
    assert_false(parse(TYPE, body, at, 100, &record, &err));
    assert_non_null(strstr(err.message, "header lines"));
    free(body);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_same_parts_come_out_however_the_body_is_cut),
        cmocka_unit_test(random_data_comes_out_as_it_went_in),
        cmocka_unit_test(every_refusal_has_a_reason),
        cmocka_unit_test(headers_without_end_are_cut_off),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

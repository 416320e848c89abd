/* SPDX-License-Identifier: MIT */
/* Prints JSON values as outlines and lines. */
#include "clients/vitrail/json_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT_BYTES = 4096, DEPTH_MAX = 32 };

static bool is_plain(const json_t *json)
{
    return !json_is_object(json) && !json_is_array(json);
}

static bool is_plain_list(const json_t *json)
{
    const json_t *item;
    size_t index;

    if (!json_is_array(json))
        return false;
    json_array_foreach(json, index, item)
    {
        if (!is_plain(item))
            return false;
    }
    return true;
}

static void print_plain(const json_t *json)
{
    char text[TEXT_BYTES];

    if (json_is_string(json)) {
        text_copy_printable(text, sizeof text, json_string_value(json));
        fputs(text, stdout);
    } else if (json_is_integer(json)) {
        printf("%" JSON_INTEGER_FORMAT, json_integer_value(json));
    } else if (json_is_real(json)) {
        printf("%.6g", json_real_value(json));
    } else {
        fputs(json_is_true(json) ? "yes" : json_is_false(json) ? "no" : "-", stdout);
    }
}

static void print_plain_list(const json_t *json)
{
    const json_t *item;
    size_t index;

    json_array_foreach(json, index, item)
    {
        fputs(index ? ", " : "", stdout);
        print_plain(item);
    }
    if (json_array_size(json) == 0)
        fputs("none", stdout);
}

/* {"a": 1, "b": 2} on one line: what a list of many small objects is read best as. */
static bool print_as_row(json_t *json)
{
    const char *key, *separator = "";
    json_t *member;

    json_object_foreach(json, key, member)
    {
        if (!is_plain(member))
            return false;
    }
    json_object_foreach(json, key, member)
    {
        char name[TEXT_BYTES];
        text_copy_printable(name, sizeof name, key);
        printf("%s%s: ", separator, name);
        print_plain(member);
        separator = ", ";
    }
    return json_is_object(json);
}

/* Prints what follows "key:" or "-" on its line, and all lines below it. */
static void print_value(json_t *json, int depth)
{
    const char *key;
    json_t *member;
    size_t index;

    if (is_plain(json)) {
        putchar(' ');
        print_plain(json);
    } else if (is_plain_list(json)) {
        putchar(' ');
        print_plain_list(json);
    }
    if (depth > 0 || is_plain(json) || is_plain_list(json))
        putchar('\n');
    if (is_plain(json) || is_plain_list(json) || depth > DEPTH_MAX)
        return;
    json_object_foreach(json, key, member)
    {
        char name[TEXT_BYTES];
        text_copy_printable(name, sizeof name, key);
        printf("%*s%s:", 2 * depth, "", name);
        print_value(member, depth + 1);
    }
    json_array_foreach(json, index, member)
    {
        printf("%*s- ", 2 * depth, "");
        if (print_as_row(member))
            putchar('\n');
        else
            print_value(member, depth + 1);
    }
}

void json_print(json_t *json, bool as_json)
{
    if (as_json) {
        json_dumpf(json, stdout, JSON_COMPACT | JSON_ENCODE_ANY);
        putchar('\n');
    } else {
        print_value(json, 0);
    }
}

bool json_write(const json_t *json, struct output_file *file, struct failure *failure)
{
    char *text = json_dumps(json, JSON_INDENT(2) | JSON_ENCODE_ANY);
    bool is_ok;

    if (!text)
        return fail_no_memory(failure);
    is_ok = output_file_write(file, text, strlen(text), failure) &&
            output_file_write(file, "\n", 1, failure);
    free(text);
    return is_ok;
}

/* SPDX-License-Identifier: MIT */
/* Writing JSON members, with texts and numbers made safe on the way. */
#include "protocol/json_write.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "protocol/utf8.h"

struct json_writer json_writer_begin(void)
{
    json_t *object = json_object();
    return (struct json_writer){.object = object, .has_failed = !object};
}

void json_put(struct json_writer *writer, const char *key, json_t *value)
{
    /* Takes the value, and refuses NULL, whatever state the object is in. */
    if (json_object_set_new(writer->object, key, value) != 0)
        writer->has_failed = true;
}

json_t *json_take_unless(json_t *json, bool has_failed)
{
    if (!has_failed)
        return json;
    json_decref(json);
    return NULL;
}

void json_append(json_t *array, json_t *value, bool *has_failed)
{
    if (json_array_append_new(array, value) != 0)
        *has_failed = true;
}

json_t *json_text(const char *text)
{
    json_t *value = json_string(text ? text : "");
    if (value || !text)
        return value;
    char *copy = strdup(text);
    if (!copy)
        return NULL;
    utf8_sanitize(copy, false);
    value = json_string(copy);
    free(copy);
    return value;
}

json_t *json_finite(double number)
{
    return isfinite(number) ? json_real(number) : json_null();
}

json_t *json_time(int64_t unix_s)
{
    char text[64];
    time_t time = (time_t)unix_s;
    struct tm utc;
    if (unix_s == 0 || !gmtime_r(&time, &utc) ||
        strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc) == 0)
        return json_null();
    return json_string(text);
}

json_t *json_numbers(const double *numbers, size_t count)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (size_t i = 0; i < count; i++)
        json_append(array, json_finite(numbers[i]), &has_failed);
    return json_take_unless(array, has_failed);
}

json_t *json_texts(const char *texts, size_t stride, int count)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (int i = 0; i < count; i++)
        json_append(array, json_text(texts + (size_t)i * stride), &has_failed);
    return json_take_unless(array, has_failed);
}

void json_put_text(struct json_writer *writer, const char *key, const char *text)
{
    json_put(writer, key, json_text(text));
}

void json_put_text_or_null(struct json_writer *writer, const char *key, const char *text)
{
    json_put(writer, key, text && *text ? json_text(text) : json_null());
}

void json_put_number(struct json_writer *writer, const char *key, double number)
{
    json_put(writer, key, json_finite(number));
}

void json_put_numbers(struct json_writer *writer, const char *key, const double *numbers, size_t n)
{
    json_put(writer, key, json_numbers(numbers, n));
}

void json_put_integer(struct json_writer *writer, const char *key, uint64_t number)
{
    json_put(writer, key, json_integer(number > INT64_MAX ? INT64_MAX : (json_int_t)number));
}

void json_put_bool(struct json_writer *writer, const char *key, bool value)
{
    json_put(writer, key, json_boolean(value));
}

json_t *json_writer_take(struct json_writer *writer)
{
    json_t *object = writer->object;
    writer->object = NULL;
    return json_take_unless(object, writer->has_failed);
}

char *json_take_dump(json_t *json, size_t flags)
{
    char *text = json ? json_dumps(json, flags) : NULL;
    json_decref(json);
    return text;
}

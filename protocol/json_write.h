/* SPDX-License-Identifier: MIT */
/* Building JSON objects without a check per member: a failure is kept and reported at the end.
 * Thread: any. */
#ifndef VITRAIL_PROTOCOL_JSON_WRITE_H
#define VITRAIL_PROTOCOL_JSON_WRITE_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

/* An object under construction. The only reasons to fail are memory and texts beyond repair. */
struct json_writer {
    json_t *object; /* owned until json_writer_take */
    bool has_failed;
};

struct json_writer json_writer_begin(void);

/* Each takes `value`; a NULL marks the failure. */
void json_put(struct json_writer *writer, const char *key, json_t *value);
void json_append(json_t *array, json_t *value, bool *has_failed);

/* `json`, or NULL (and nothing leaked) when its making failed. */
MUST_CHECK json_t *json_take_unless(json_t *json, bool has_failed);

void json_put_text(struct json_writer *writer, const char *key, const char *text);
void json_put_text_or_null(struct json_writer *writer, const char *key, const char *text);
void json_put_number(struct json_writer *writer, const char *key, double number);
void json_put_numbers(struct json_writer *writer, const char *key, const double *numbers, size_t n);
void json_put_integer(struct json_writer *writer, const char *key, uint64_t number);
void json_put_bool(struct json_writer *writer, const char *key, bool value);

json_t *json_text(const char *text); /* malformed UTF-8 becomes '?'; NULL reads as "" */
json_t *json_finite(double number);  /* null when it is not finite */
/* RFC 3339 in UTC; null when the time is 0, never set, or has no calendar date. */
json_t *json_time(int64_t unix_s);
json_t *json_numbers(const double *numbers, size_t count);
/* An array of so many texts, as json_text, whose beginnings lie `stride` bytes apart. */
json_t *json_texts(const char *texts, size_t stride, int count);

/* The object, or NULL (and nothing leaked) when anything failed. */
MUST_CHECK json_t *json_writer_take(struct json_writer *writer);

/* Dumps and releases `json` (NULL gives NULL). malloc'ed; flags as json_dumps. */
MUST_CHECK char *json_take_dump(json_t *json, size_t flags);

#endif

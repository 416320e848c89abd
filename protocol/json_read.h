/* SPDX-License-Identifier: MIT */
/* Strict reading of JSON: every refusal names the member by its pointer, what was found and what is
 * allowed. Used by the parsers of protocol/ only. Thread: any. */
#ifndef VITRAIL_PROTOCOL_JSON_READ_H
#define VITRAIL_PROTOCOL_JSON_READ_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

/* A place in a document. Lives on the stack of the function that reads it; borrows everything.
 * A `null` counts as absent. */
struct json_node {
    json_t *value;                  /* NULL: absent */
    const struct json_node *parent; /* NULL at the root */
    const char *key;                /* NULL: element `index` of an array */
    size_t index;
    struct error *err;
};

/* Loads a text of at most max_bytes after bounding its depth and its number of values, so that a
 * small hostile text can neither exhaust the stack nor the memory. Duplicate keys are refused.
 * New reference, or NULL with err set. */
MUST_CHECK json_t *json_load_checked(const char *json, size_t length, size_t max_bytes,
                                     struct error *err);

struct json_node json_root(json_t *value, struct error *err);
struct json_node json_member(const struct json_node *object, const char *key);
struct json_node json_element(const struct json_node *array, size_t index);

/* Sets the error "POINTER is FOUND, <format>" at the node. Always returns false. */
bool json_refuse(const struct json_node *node, enum error_code code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Whether the list (NULL-terminated) has the name. */
bool json_is_known(const char *name, const char *const *known);

/* The member `key` of the node is none of `known`: names the nearest one, and lists them. */
bool json_refuse_unknown(const struct json_node *node, const char *key, const char *const *known);

/* The node is an object and has no members but these (NULL-terminated; NULL allows any). */
MUST_CHECK bool json_expect_object(const struct json_node *node, const char *const *known);
MUST_CHECK bool json_expect_array(const struct json_node *node, size_t max_count, size_t *count);
MUST_CHECK bool json_expect_present(const struct json_node *node);

/* Each leaves *out as it was and succeeds when the node is absent. Ranges include their ends. */
MUST_CHECK bool json_read_bool(const struct json_node *node, bool *out);
MUST_CHECK bool json_read_number(const struct json_node *node, double min, double max, double *out);
MUST_CHECK bool json_read_numbers(const struct json_node *node, size_t count, double min,
                                  double max, double *out);
MUST_CHECK bool json_read_int(const struct json_node *node, int min, int max, int *out);
MUST_CHECK bool json_read_uint64(const struct json_node *node, uint64_t *out);

/* A string of 1 to LIMIT_NAME_BYTES bytes, borrowed from the document. */
MUST_CHECK bool json_read_name(const struct json_node *node, const char **out);

/* A string of any length, cut to fit. */
MUST_CHECK bool json_read_text(const struct json_node *node, char *buffer, size_t size_bytes);

/* One of the names of an enum. */
struct json_choice {
    const char *(*name)(int index); /* NULL past the last */
    int first;                      /* lowest index that may be named */
};
MUST_CHECK bool json_read_choice(const struct json_node *node, const struct json_choice *choice,
                                 int *out);

#endif

/* SPDX-License-Identifier: MIT */
/* Bounded loading of JSON, and typed reading of its members with errors that say where. */
#include "protocol/json_read.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/nearest.h"
#include "protocol/utf8.h"

/* ---- loading ---- */

/* What a text would cost to parse, counted without parsing it. */
struct text_size {
    size_t depth, containers, values;
};

/* One pass that knows only strings and brackets; malformed texts may be miscounted, never missed:
 * the parser stops at their first error, before which the counts are true. */
static bool text_check(const char *json, size_t length, struct error *err)
{
    struct text_size size = {0};
    bool is_in_string = false;
    for (size_t i = 0; i < length; i++) {
        char c = json[i];
        if (is_in_string) {
            if (c == '\\')
                i++;
            else if (c == '"')
                is_in_string = false;
            continue;
        }
        if (c == '"') {
            is_in_string = true;
        } else if (c == '{' || c == '[') {
            size.containers++;
            size.values++;
            if (++size.depth > LIMIT_JSON_DEPTH)
                return error_set(err, ERROR_INVALID_REQUEST,
                                 "the JSON is nested deeper than %d at byte %zu", LIMIT_JSON_DEPTH,
                                 i);
        } else if ((c == '}' || c == ']') && size.depth > 0) {
            size.depth--;
        } else if (c == ',') {
            size.values++;
        }
        if (size.containers > LIMIT_JSON_CONTAINERS || size.values > LIMIT_JSON_VALUES)
            return error_set(err, ERROR_TOO_LARGE,
                             "the JSON has more than %d arrays and objects or %d values",
                             LIMIT_JSON_CONTAINERS, LIMIT_JSON_VALUES);
    }
    return true;
}

/* Why jansson takes a text for no JSON; where that is a setting of its own, in our words. */
static const char *reason(const json_error_t *found)
{
    switch (json_error_code(found)) {
    case json_error_null_byte_in_key:
    case json_error_null_character:
        return "a text holds \\u0000";
    case json_error_numeric_overflow:
        return "a number is too large";
    default:
        return found->text;
    }
}

json_t *json_load_checked(const char *json, size_t length, size_t max_bytes, struct error *err)
{
    if (length > max_bytes) {
        error_set(err, ERROR_TOO_LARGE, "the JSON has %zu bytes, the limit is %zu", length,
                  max_bytes);
        return NULL;
    }
    if (length == 0) {
        error_set(err, ERROR_INVALID_REQUEST, "the body is empty, a JSON object is needed");
        return NULL;
    }
    if (!text_check(json, length, err))
        return NULL;
    json_error_t found = {0};
    json_t *root = json_loadb(json, length, JSON_REJECT_DUPLICATES, &found);
    if (!root && !found.text[0]) /* jansson says nothing only when memory runs out */
        error_set(err, ERROR_NO_MEMORY, "parsing %zu bytes of JSON", length);
    else if (!root)
        error_set(err, ERROR_INVALID_REQUEST, "not valid JSON, line %d column %d: %s", found.line,
                  found.column, reason(&found));
    return root;
}

/* ---- places ---- */

struct json_node json_root(json_t *value, struct error *err)
{
    return (struct json_node){.value = value, .err = err};
}

static json_t *present(json_t *value)
{
    return json_is_null(value) ? NULL : value;
}

struct json_node json_member(const struct json_node *object, const char *key)
{
    return (struct json_node){
        .value = present(json_object_get(object->value, key)),
        .parent = object,
        .key = key,
        .err = object->err,
    };
}

struct json_node json_element(const struct json_node *array, size_t index)
{
    return (struct json_node){
        .value = json_array_get(array->value, index),
        .parent = array,
        .index = index,
        .err = array->err,
    };
}

/* Appends at *used, silently full; the escapes are those of RFC 6901. */
static void pointer_append(char *pointer, size_t size, size_t *used, const char *text)
{
    for (; *text; text++) {
        const char *escaped = *text == '~' ? "~0" : *text == '/' ? "~1" : NULL;
        size_t bytes = escaped ? 2 : 1;
        if (*used + bytes >= size)
            return;
        memcpy(pointer + *used, escaped ? escaped : text, bytes);
        *used += bytes;
        pointer[*used] = '\0';
    }
}

static void pointer_write(const struct json_node *node, char *pointer, size_t size, size_t *used)
{
    if (!node->parent)
        return;
    pointer_write(node->parent, pointer, size, used);
    if (*used + 1 < size)
        pointer[(*used)++] = '/';
    pointer[*used] = '\0';
    char index[24];
    snprintf(index, sizeof index, "%zu", node->index);
    pointer_append(pointer, size, used, node->key ? node->key : index);
}

/* A few words on what is there instead of what should be. */
static void describe(const json_t *value, char *text, size_t size)
{
    char part[48];
    switch (value ? json_typeof(value) : JSON_NULL) {
    case JSON_OBJECT:
        snprintf(text, size, "an object of %zu members", json_object_size(value));
        break;
    case JSON_ARRAY:
        snprintf(text, size, "an array of %zu", json_array_size(value));
        break;
    case JSON_STRING:
        utf8_copy(part, sizeof part, json_string_value(value));
        snprintf(text, size, "\"%s%s\"", part,
                 strlen(part) < json_string_length(value) ? "..." : "");
        break;
    case JSON_INTEGER:
        snprintf(text, size, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
        break;
    case JSON_REAL:
        snprintf(text, size, "%.9g", json_real_value(value));
        break;
    case JSON_TRUE:
    case JSON_FALSE:
        snprintf(text, size, "%s", json_is_true(value) ? "true" : "false");
        break;
    case JSON_NULL:
        snprintf(text, size, "%s", value ? "null" : "absent");
        break;
    }
}

bool json_refuse(const struct json_node *node, enum error_code code, const char *format, ...)
{
    enum { SHOWN_MAX = 96 }; /* leaves most of a message to what is allowed */
    char pointer[2 * ERROR_POINTER_BYTES] = "", shown[SHOWN_MAX], found[80],
                     allowed[ERROR_MESSAGE_BYTES];
    size_t used = 0;
    pointer_write(node, pointer, sizeof pointer, &used);
    utf8_copy(shown, sizeof shown, pointer);
    describe(node->value, found, sizeof found);
    va_list args;
    va_start(args, format);
    vsnprintf(allowed, sizeof allowed, format, args);
    va_end(args);
    return error_set_at(node->err, code, pointer, "%s is %s%s%s", used == 0 ? "the request" : shown,
                        found, *allowed ? ", " : "", allowed);
}

/* ---- containers ---- */

bool json_is_known(const char *key, const char *const *known)
{
    for (; *known; known++)
        if (strcmp(key, *known) == 0)
            return true;
    return false;
}

/* A list of names for a message: whole ones, as many as fit, and "..." where some do not. */
struct name_list {
    char text[416];
    size_t used;
};

static void list_name(struct name_list *list, const char *name)
{
    const char *mark = list->used ? ", " : "";
    size_t bytes = strlen(mark) + strlen(name);
    if (list->used + bytes + sizeof ", ..." > sizeof list->text) {
        if (list->used < sizeof list->text)
            snprintf(list->text + list->used, sizeof list->text - list->used, ", ...");
        list->used = sizeof list->text;
        return;
    }
    list->used += (size_t)snprintf(list->text + list->used, sizeof list->text - list->used, "%s%s",
                                   mark, name);
}

/* "did you mean X? " where a name is near. */
static void suggest(const struct nearest *nearest, char *text, size_t size)
{
    text[0] = '\0';
    if (nearest->name)
        snprintf(text, size, "did you mean %s? ", nearest->name);
}

bool json_refuse_unknown(const struct json_node *node, const char *key, const char *const *known)
{
    struct name_list list = {.used = 0};
    struct nearest nearest = {.text = key};
    char meant[96];
    for (size_t i = 0; known[i]; i++) {
        list_name(&list, known[i]);
        nearest_offer(&nearest, known[i]);
    }
    suggest(&nearest, meant, sizeof meant);
    struct json_node member = json_member(node, key);
    member.value = json_object_get(node->value, key);
    return json_refuse(&member, ERROR_INVALID_REQUEST, "but there is no such member; %sknown: %s",
                       meant, list.text);
}

bool json_expect_object(const struct json_node *node, const char *const *known)
{
    if (!json_is_object(node->value))
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be an object");
    const char *key;
    json_t *value;
    if (known)
        json_object_foreach(
            node->value, key,
            value) if (!json_is_known(key, known)) return json_refuse_unknown(node, key, known);
    return true;
}

bool json_expect_array(const struct json_node *node, size_t max_count, size_t *count)
{
    *count = 0;
    if (!node->value)
        return true;
    if (!json_is_array(node->value))
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be an array");
    *count = json_array_size(node->value);
    if (*count > max_count)
        return json_refuse(node, ERROR_TOO_LARGE, "the limit is %zu", max_count);
    return true;
}

bool json_expect_present(const struct json_node *node)
{
    return node->value || json_refuse(node, ERROR_INVALID_REQUEST, "but it is required");
}

/* ---- scalars ---- */

bool json_read_bool(const struct json_node *node, bool *out)
{
    if (!node->value)
        return true;
    if (!json_is_boolean(node->value))
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be true or false");
    *out = json_is_true(node->value);
    return true;
}

bool json_read_number(const struct json_node *node, double min, double max, double *out)
{
    if (!node->value)
        return true;
    if (!json_is_number(node->value))
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be a number");
    double number = json_number_value(node->value);
    if (!(number >= min && number <= max)) /* also refuses NaN */
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be from %.9g to %.9g", min, max);
    *out = number + 0.0; /* no negative zero, so that equal requests have equal text */
    return true;
}

bool json_read_numbers(const struct json_node *node, size_t count, double min, double max,
                       double *out)
{
    if (!node->value)
        return true;
    if (!json_is_array(node->value) || json_array_size(node->value) != count)
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be an array of %zu numbers", count);
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(node, i);
        if (!json_read_number(&element, min, max, &out[i]))
            return false;
    }
    return true;
}

bool json_read_int(const struct json_node *node, int min, int max, int *out)
{
    if (!node->value)
        return true;
    double number = json_is_number(node->value) ? json_number_value(node->value) : NAN;
    if (!(number >= min && number <= max) || number != floor(number))
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be a whole number from %d to %d", min,
                           max);
    *out = (int)number;
    return true;
}

bool json_read_uint64(const struct json_node *node, uint64_t *out)
{
    if (!node->value)
        return true;
    if (!json_is_integer(node->value) || json_integer_value(node->value) < 0)
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be a whole number of at least 0");
    *out = (uint64_t)json_integer_value(node->value);
    return true;
}

bool json_read_name(const struct json_node *node, const char **out)
{
    if (!node->value)
        return true;
    size_t length = json_string_length(node->value);
    if (!json_is_string(node->value) || length < 1 || length > LIMIT_NAME_BYTES)
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be a string of 1 to %d bytes",
                           LIMIT_NAME_BYTES);
    *out = json_string_value(node->value);
    return true;
}

bool json_read_text(const struct json_node *node, char *buffer, size_t size_bytes)
{
    if (!node->value)
        return true;
    if (!json_is_string(node->value))
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be a string");
    utf8_copy(buffer, size_bytes, json_string_value(node->value));
    return true;
}

bool json_read_choice(const struct json_node *node, const struct json_choice *choice, int *out)
{
    if (!node->value)
        return true;
    const char *found = json_is_string(node->value) ? json_string_value(node->value) : NULL;
    struct name_list list = {.used = 0};
    struct nearest nearest = {.text = found ? found : ""};
    char meant[96];
    for (int i = choice->first; choice->name(i); i++) {
        if (found && strcmp(found, choice->name(i)) == 0) {
            *out = i;
            return true;
        }
        list_name(&list, choice->name(i));
        if (found)
            nearest_offer(&nearest, choice->name(i));
    }
    suggest(&nearest, meant, sizeof meant);
    return json_refuse(node, ERROR_INVALID_REQUEST, "%smust be one of: %s", meant, list.text);
}

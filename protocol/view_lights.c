/* SPDX-License-Identifier: MIT */
/* Patches that name lights by their index, so that one of thousands is changed by itself. */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_write.h"
#include "protocol/limits.h"
#include "protocol/view_parts.h"

/* An index in decimal, as RFC 6901 writes it. */
static bool read_index(const char *key, size_t *index)
{
    if (!isdigit((unsigned char)key[0]) || (key[0] == '0' && key[1]) || strlen(key) > 6)
        return false;
    char *end;
    *index = strtoul(key, &end, 10);
    return !*end;
}

/* How many lights there would be before any is taken out, and how many are. */
struct light_counts {
    size_t before, after, gone;
};

/* What comes is without gaps, and only what is there goes. */
static bool check_indices(const struct json_node *node, struct light_counts *counts)
{
    size_t added = 0, index;
    const char *key;
    json_t *value;
    counts->after = counts->before;
    counts->gone = 0;
    json_object_foreach(node->value, key, value)
    {
        struct json_node member = json_member(node, key);
        member.value = value; /* also a null */
        bool is_gone = json_is_null(value);
        if (!read_index(key, &index) || (is_gone && index >= counts->before))
            return json_refuse(&member, ERROR_INVALID_REQUEST, "but the view has %zu lights",
                               counts->before);
        if (!is_gone && !json_is_object(value))
            return json_refuse(&member, ERROR_INVALID_REQUEST, "must be a light or null");
        counts->gone += is_gone;
        added += index >= counts->before;
        counts->after = index >= counts->after ? index + 1 : counts->after;
    }
    if (counts->before + added != counts->after)
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "but lights are added behind the %zu that there are, without gaps",
                           counts->before);
    return counts->after - counts->gone <= LIMIT_REQUEST_LIGHTS ||
           json_refuse(node, ERROR_TOO_LARGE, "the limit is %d lights", LIMIT_REQUEST_LIGHTS);
}

json_t *view_lights_touched(const json_t *lights, const struct json_node *patch)
{
    struct light_counts counts = {.before = json_array_size(lights)};
    if (!check_indices(patch, &counts))
        return NULL;
    json_t *touched = json_array();
    bool has_failed = !touched;
    size_t index;
    const char *key;
    json_t *value;
    json_object_foreach(patch->value, key, value)
    {
        if (json_is_null(value) || !read_index(key, &index))
            continue;
        bool is_whole = json_object_get(value, "type");
        json_append(touched, view_merge(is_whole ? NULL : json_array_get(lights, index), value),
                    &has_failed);
    }
    touched = json_take_unless(touched, has_failed);
    if (!touched)
        error_set(patch->err, ERROR_NO_MEMORY, "lights");
    return touched;
}

void view_lights_point(const json_t *patch, struct error *err)
{
    static const char start[] = "/lights/";
    size_t place, at = 0;
    int used = 0;
    const char *key;
    json_t *value;
    if (strncmp(err->pointer, start, sizeof start - 1) != 0 ||
        sscanf(err->pointer + sizeof start - 1, "%zu%n", &place, &used) != 1)
        return;
    json_object_foreach((json_t *)(uintptr_t)patch, key, value)
    {
        if (json_is_null(value) || at++ < place)
            continue;
        struct error found = *err;
        char pointer[ERROR_POINTER_BYTES + 32];
        size_t length = strlen(found.pointer);
        bool is_said = strncmp(found.message, found.pointer, length) == 0;
        snprintf(pointer, sizeof pointer, "%s%s%s", start, key,
                 found.pointer + sizeof start - 1 + used);
        *err = (struct error){0};
        error_set_at(err, found.code, pointer, "%s%s", is_said ? pointer : "",
                     found.message + (is_said ? length : 0));
        return;
    }
}

void view_lights_install(json_t *lights, const json_t *canonical, json_t *patch)
{
    size_t index, place = 0, kept = 0;
    bool is_shorter = false;
    const char *key;
    json_t *value;
    json_object_foreach(patch, key, value)
    {
        if (!read_index(key, &index))
            continue;
        while (json_array_size(lights) <= index && json_array_append_new(lights, json_null()) == 0)
            continue;
        is_shorter |= json_is_null(value);
        json_array_set(lights, index,
                       json_is_null(value) ? value : json_array_get(canonical, place++));
    }
    for (size_t i = 0; is_shorter && i < json_array_size(lights); i++)
        if (!json_is_null(json_array_get(lights, i)))
            json_array_set(lights, kept++, json_array_get(lights, i));
    while (is_shorter && json_array_size(lights) > kept)
        json_array_remove(lights, json_array_size(lights) - 1);
}

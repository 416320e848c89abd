/* SPDX-License-Identifier: MIT */
/* Names as the keys of jansson's hash tables. */
#include "protocol/view_names.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>

#include "protocol/scene_summary.h"

struct name_set {
    json_t *keys;    /* owned object; its values mean nothing */
    uint64_t count;  /* true number of things, named or not */
    bool is_partial; /* the summary holds the first of them only */
};

struct view_names {
    struct name_set sets[VIEW_NAME_KIND_COUNT];
};

/* Of a list of names, or of objects that have one. */
static bool fill(struct name_set *set, const json_t *names, uint64_t count)
{
    size_t i;
    const json_t *name;
    set->keys = json_object();
    set->count = count;
    set->is_partial = json_array_size(names) < count;
    bool is_good = set->keys;
    json_array_foreach(names, i, name)
    {
        const char *text =
            json_string_value(json_is_object(name) ? json_object_get(name, "name") : name);
        if (is_good && text)
            is_good = json_object_set_new(set->keys, text, json_true()) == 0;
    }
    return is_good;
}

static uint64_t number(const json_t *summary, const char *key)
{
    return (uint64_t)json_integer_value(json_object_get(summary, key));
}

struct view_names *view_names_create(json_t *summary, struct error *err)
{
    struct view_names *names = calloc(1, sizeof *names);
    if (names &&
        fill(&names->sets[VIEW_NAME_NODE], json_object_get(summary, "node_names"),
             number(summary, "nodes")) &&
        fill(&names->sets[VIEW_NAME_MATERIAL], json_object_get(summary, "materials"),
             number(summary, "material_count")) &&
        fill(&names->sets[VIEW_NAME_GRID], json_object_get(summary, "density_grids"),
             number(summary, "density_grid_count")) &&
        fill(&names->sets[VIEW_NAME_ANIMATION], json_object_get(summary, "animations"),
             number(summary, "animation_count")) &&
        fill(&names->sets[VIEW_NAME_VARIANT], json_object_get(summary, "variants"),
             number(summary, "variant_count")))
        return names;
    view_names_destroy(names);
    error_set(err, ERROR_NO_MEMORY, "names of a scene");
    return NULL;
}

void view_names_destroy(struct view_names *names)
{
    if (!names)
        return;
    for (int i = 0; i < VIEW_NAME_KIND_COUNT; i++)
        json_decref(names->sets[i].keys);
    free(names);
}

bool view_names_may_have(const struct view_names *names, enum view_name_kind kind, const char *name)
{
    const struct name_set *set = &names->sets[kind];
    if (set->is_partial || json_object_get(set->keys, name))
        return true;
    if (name[0] != '#' || !isdigit((unsigned char)name[1]))
        return false;
    char *end;
    unsigned long long index = strtoull(name + 1, &end, 10);
    return !*end && index < set->count;
}

bool view_names_has(const struct view_names *names, enum view_name_kind kind, const char *name)
{
    return json_object_get(names->sets[kind].keys, name);
}

void view_names_list(const struct view_names *names, enum view_name_kind kind, char *text,
                     size_t size_bytes)
{
    const char *name;
    json_t *value;
    size_t length = 0;
    text[0] = '\0';
    json_object_foreach(names->sets[kind].keys, name, value)
    {
        length += (size_t)snprintf(text + length, size_bytes - length, "%s'%s'", length ? ", " : "",
                                   name);
        if (length >= size_bytes)
            break;
    }
}

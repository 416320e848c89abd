/* SPDX-License-Identifier: MIT */
/* A growing list of program descriptions. */
#include "renderer/gl/program_list.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_same(const char *a, const char *b)
{
    return a == b || (a && b && !strcmp(a, b));
}

/* Whether a listed program is of these files and defines. */
static bool is_of(const struct listed_program *item, const struct program_desc *desc)
{
    return is_same(item->vertex, desc->vertex) &&
           is_same(item->tessellation[0], desc->tessellation[0]) &&
           is_same(item->tessellation[1], desc->tessellation[1]) &&
           is_same(item->geometry, desc->geometry) && is_same(item->fragment, desc->fragment) &&
           is_same(item->compute, desc->compute) &&
           is_same(item->defines, desc->defines ? desc->defines : "");
}

static struct listed_program *find(const struct program_list *list, const char *pass,
                                   const struct program_desc *desc)
{
    for (size_t i = list->count; i-- > 0;)
        if (is_same(list->items[i].pass, pass) && is_of(&list->items[i], desc))
            return &list->items[i];
    return NULL;
}

static bool reserve(struct program_list *list)
{
    if (list->count < list->capacity)
        return true;
    size_t capacity = list->capacity ? 2 * list->capacity : 32;
    void *grown = realloc(list->items, capacity * sizeof *list->items);
    if (!grown) {
        list->has_failed = true;
        return false;
    }
    list->items = grown;
    list->capacity = capacity;
    return true;
}

void program_list_add(struct program_list *list, const char *pass, const struct program_desc *desc,
                      bool is_conditional)
{
    struct listed_program *item = find(list, pass, desc);
    if (item) {
        item->is_conditional &= is_conditional;
        return;
    }
    if (!reserve(list))
        return;
    item = &list->items[list->count++];
    *item = (struct listed_program){.pass = pass,
                                    .label = desc->label,
                                    .vertex = desc->vertex,
                                    .tessellation = {desc->tessellation[0], desc->tessellation[1]},
                                    .geometry = desc->geometry,
                                    .fragment = desc->fragment,
                                    .compute = desc->compute,
                                    .is_conditional = is_conditional};
    int length =
        snprintf(item->defines, sizeof item->defines, "%s", desc->defines ? desc->defines : "");
    assert(length < (int)sizeof item->defines);
}

bool program_list_is_same(const struct listed_program *a, const struct listed_program *b)
{
    const struct program_desc desc = program_list_desc(b);
    return is_of(a, &desc);
}

struct program_desc program_list_desc(const struct listed_program *program)
{
    return (struct program_desc){
        .label = program->label,
        .vertex = program->vertex,
        .tessellation = {program->tessellation[0], program->tessellation[1]},
        .geometry = program->geometry,
        .fragment = program->fragment,
        .compute = program->compute,
        .defines = program->defines};
}

bool program_list_check(const struct program_list *list, struct error *err)
{
    return !list->has_failed || error_set(err, ERROR_NO_MEMORY, "%zu programs", list->count);
}

void program_list_finish(struct program_list *list)
{
    free(list->items);
    *list = (struct program_list){0};
}

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

static struct listed_program *find(const struct program_list *list, const char *pass,
                                   const struct program_desc *desc)
{
    for (size_t i = list->count; i-- > 0;) {
        struct listed_program *item = &list->items[i];
        if (is_same(item->pass, pass) && is_same(item->vertex, desc->vertex) &&
            is_same(item->fragment, desc->fragment) && is_same(item->compute, desc->compute) &&
            is_same(item->defines, desc->defines ? desc->defines : ""))
            return item;
    }
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
                                    .fragment = desc->fragment,
                                    .compute = desc->compute,
                                    .is_conditional = is_conditional};
    int length =
        snprintf(item->defines, sizeof item->defines, "%s", desc->defines ? desc->defines : "");
    assert(length < (int)sizeof item->defines);
}

bool program_list_is_same(const struct listed_program *a, const struct listed_program *b)
{
    return is_same(a->vertex, b->vertex) && is_same(a->fragment, b->fragment) &&
           is_same(a->compute, b->compute) && is_same(a->defines, b->defines);
}

struct program_desc program_list_desc(const struct listed_program *program)
{
    return (struct program_desc){.label = program->label,
                                 .vertex = program->vertex,
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

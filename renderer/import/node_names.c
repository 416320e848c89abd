/* SPDX-License-Identifier: MIT */
/* A sorted list of names, and lookups in it. */
#include "renderer/import/node_names.h"

#include <stdlib.h>
#include <string.h>

static int compare_texts(const void *left, const void *right)
{
    const char *const *a = left, *const *b = right;
    return strcmp(*a, *b);
}

bool node_names_init(struct node_names *names, const struct gltf_document *document,
                     struct error *err)
{
    *names = (struct node_names){.count = 0};
    names->items = malloc((document->node_count + 1) * sizeof *names->items);
    if (!names->items)
        return error_set(err, ERROR_NO_MEMORY, "%zu names of nodes", document->node_count);
    for (size_t i = 0; i < document->node_count; i++)
        if (document->nodes[i].name[0])
            names->items[names->count++] = document->nodes[i].name;
    qsort(names->items, names->count, sizeof *names->items, compare_texts);
    return true;
}

void node_names_finish(struct node_names *names)
{
    free(names->items);
    *names = (struct node_names){.count = 0};
}

bool node_names_are_taken(const struct node_names *names, const char *name)
{
    return name[0] == '#' ||
           bsearch(&name, names->items, names->count, sizeof *names->items, compare_texts);
}

const char *node_names_find(const struct node_names *names, const struct gltf_document *document,
                            const struct gltf_node *node)
{
    if (node->name[0] || node->mesh < 0)
        return node->name;
    const char *name = document->meshes[node->mesh].name;
    return node_names_are_taken(names, name) ? "" : name;
}

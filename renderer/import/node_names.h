/* SPDX-License-Identifier: MIT */
/* What nodes are called: requests find a node by its name. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_NODE_NAMES_H
#define VITRAIL_RENDERER_IMPORT_NODE_NAMES_H

#include "renderer/import/gltf_shim.h"

/* The names that the file's nodes have of their own, sorted. */
struct node_names {     /* zeroed: none */
    const char **items; /* owned; the texts are the document's */
    size_t count;
};

MUST_CHECK bool node_names_init(struct node_names *names, const struct gltf_document *document,
                                struct error *err);
void node_names_finish(struct node_names *names);

/* Whether a node that has no such name of its own may not take it: another one has, or it looks
 * like an index ("#12"). Requests would find the wrong node otherwise. */
bool node_names_are_taken(const struct node_names *names, const char *name);

/* Files of CAD programs name the meshes and leave the nodes without a name: such a node is called
 * as its mesh. "" where that name is taken. */
const char *node_names_find(const struct node_names *names, const struct gltf_document *document,
                            const struct gltf_node *node);

#endif

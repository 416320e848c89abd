/* SPDX-License-Identifier: MIT */
/* Instances of EXT_mesh_gpu_instancing, each a node of its own. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_IMPORT_INSTANCES_H
#define VITRAIL_RENDERER_IMPORT_IMPORT_INSTANCES_H

#include "renderer/import/importer.h"
#include "renderer/import/node_names.h"

/* Whether the mesh of a node is shown by its instances and not by the node itself. A skin places
 * its mesh by the joints alone, so that its instances would all be in one place: they are left out.
 */
bool node_has_instances(const struct gltf_node *node);

/* Appends the instances of all nodes behind these, so that the indices of nodes stay: each is a
 * child of its node, has the node's mesh, and is called as the node with its number ("Tree #3"). */
MUST_CHECK bool import_instances(struct importer *importer, const struct node_names *names,
                                 struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* Takes "indices" out of the primitives of glTF JSON: tinygltf refuses those whose accessor has no
 * buffer view, which is how KHR_draco_mesh_compression leaves them. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_INDICES_H
#define VITRAIL_RENDERER_IMPORT_GLTF_INDICES_H

#include "renderer/import/gltf_json.h"

/* The accessor of each primitive in the order of the document, -1 where it has none. */
struct gltf_indices_list { /* zeroed = empty */
    int *values;           /* owned */
    size_t count;
};

/* Reads json->rest and renames the members there. ERROR_INVALID_SCENE where one is no whole number.
 */
MUST_CHECK bool gltf_indices_take(struct gltf_indices_list *list, struct gltf_json *json,
                                  struct error *err);
void gltf_indices_finish(struct gltf_indices_list *list); /* accepts half-built */

#endif

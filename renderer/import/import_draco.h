/* SPDX-License-Identifier: MIT */
/* The geometry of a primitive with KHR_draco_mesh_compression, while it is imported. Thread: any.
 */
#ifndef VITRAIL_RENDERER_IMPORT_IMPORT_DRACO_H
#define VITRAIL_RENDERER_IMPORT_IMPORT_DRACO_H

#include "renderer/import/importer.h"

struct draco_geometry {                     /* zeroed: there is none */
    void *attributes[GLTF_ATTRIBUTE_COUNT]; /* owned; NULL: the stream does not have it */
    uint32_t *indices;                      /* owned */
    uint64_t index_count;
};

/* Decodes indices and attributes that the extension names, whose accessors they must agree with. An
 * error names what does not agree. Leaves a primitive without the extension alone. */
MUST_CHECK bool draco_geometry_init(struct draco_geometry *geometry, struct importer *importer,
                                    const struct gltf_primitive *from, struct error *err);
void draco_geometry_finish(struct draco_geometry *geometry); /* accepts half-built */

#endif

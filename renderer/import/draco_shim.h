/* SPDX-License-Identifier: MIT */
/* Meshes of KHR_draco_mesh_compression as plain arrays. The only home of Draco is draco_shim.cpp.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_DRACO_SHIM_H
#define VITRAIL_RENDERER_IMPORT_DRACO_SHIM_H

#include "renderer/import/gltf_shim.h"

#ifdef __cplusplus
extern "C" {
#endif

struct draco_mesh; /* opaque */

struct draco_desc {
    const uint8_t *bytes; /* required, borrowed for the call */
    size_t size_bytes;
    uint32_t points;    /* that the stream must have */
    uint64_t triangles; /* likewise; 0: any number */
    uint64_t max_bytes; /* that decoding may take, as far as counts tell before it begins */
};

/* ERROR_INVALID_SCENE for a stream that is broken, has other counts or asks for more memory than
 * there is; ERROR_UNSUPPORTED for another version than 2.2; ERROR_TOO_LARGE above max_bytes. */
struct draco_mesh *draco_mesh_create(const struct draco_desc *desc, struct error *err);
void draco_mesh_destroy(struct draco_mesh *mesh); /* accepts NULL */

uint64_t draco_mesh_triangles(const struct draco_mesh *mesh);

/* Writes three indices of each triangle, not checked. */
void draco_mesh_indices(const struct draco_mesh *mesh, uint32_t *out);

/* Writes `components` numbers of each point, of a component type of glTF and tightly packed.
 * ERROR_INVALID_SCENE where the stream has no attribute of this id, or one of other components. */
MUST_CHECK bool draco_mesh_attribute(const struct draco_mesh *mesh, int id, int component,
                                     int components, void *out, struct error *err);

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: MIT */
/* Reads an upload: finds its glTF file, divides a GLB, and resolves the URIs in it. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_PACKAGE_H
#define VITRAIL_RENDERER_IMPORT_GLTF_PACKAGE_H

#include "renderer/import/import.h"

struct gltf_package {
    const struct scene_file *files; /* borrowed */
    size_t file_count;
    const struct scene_file *root; /* the .gltf or .glb among them */
    const char *json;              /* into root */
    size_t json_length;
    const uint8_t *bin; /* BIN chunk; NULL when there is none */
    size_t bin_length;
};

/* Finds the root file and takes a GLB apart. */
MUST_CHECK bool gltf_package_init(struct gltf_package *package, const struct scene_file *files,
                                  size_t file_count, struct error *err);

/* Bytes that a URI names. */
struct gltf_bytes {
    const uint8_t *bytes;
    size_t size_bytes;
    void *owned; /* what to free, NULL when borrowed from the upload */
};

/* data: URIs are decoded; every other one is a relative path, percent-decoded, among the uploaded
 * files, from the folder of the root file and never out of the upload. The error names the URI. */
MUST_CHECK bool gltf_package_resolve(const struct gltf_package *package, const char *uri,
                                     struct gltf_bytes *bytes, struct error *err);

#endif

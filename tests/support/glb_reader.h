/* SPDX-License-Identifier: MIT */
/* Reads a GLB back, independently of the renderer's importer, to check what the builder wrote.
 * Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_GLB_READER_H
#define VITRAIL_TESTS_SUPPORT_GLB_READER_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* Borrowed from the file's bytes, but for root. Zeroed = empty. */
struct glb_file {
    json_t *root;                /* owned */
    const unsigned char *binary; /* the BIN chunk; NULL when there is none */
    size_t binary_bytes;
};

/* Checks the container to the letter (glTF 2.0, 4.4) and parses the JSON. On failure `why` (of at
 * least 160 bytes) says what is wrong. */
bool glb_file_init(struct glb_file *file, const void *bytes, size_t size_bytes, char *why);
void glb_file_finish(struct glb_file *file);

/* Whether every index of the document points at something: nodes, children, meshes, materials,
 * textures, samplers, images, accessors, views, lights, cameras; every accessor lies in its view
 * and every view in the buffer; every vertex index below its vertex count. */
bool glb_file_references_hold(const struct glb_file *file, char *why);

/* Elements of a top-level array ("lights": those of KHR_lights_punctual), 0 when absent. */
size_t glb_file_count(const struct glb_file *file, const char *array);
/* Element i of it, borrowed; NULL when absent. */
json_t *glb_file_element(const struct glb_file *file, const char *array, size_t i);
/* Member by dotted path, e.g. "extensions.KHR_materials_ior.ior", digits index arrays. Borrowed,
 * NULL when absent. */
json_t *glb_member(const json_t *object, const char *path);

#endif

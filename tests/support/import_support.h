/* SPDX-License-Identifier: MIT */
/* Scenes from disk for tests: a .glb or .gltf with the files beside it, imported. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_IMPORT_SUPPORT_H
#define VITRAIL_TESTS_SUPPORT_IMPORT_SUPPORT_H

#include "renderer/import/import.h"
#include "renderer/scene/scene.h"

/* An imported scene with its blob. Zeroed = empty. */
struct imported_scene {
    void *blob; /* owned */
    size_t blob_bytes;
    struct scene scene; /* into blob */
};
void imported_scene_finish(struct imported_scene *imported);

/* Imports memory files and opens the blob. */
MUST_CHECK bool imported_scene_init(struct imported_scene *imported, const struct scene_file *files,
                                    size_t file_count, struct error *err);

/* A GLB of the JSON (its ' become ") and BIN chunk, in malloc'ed memory. bin may be NULL. */
void *glb_make(const char *json, const void *bin, size_t bin_bytes, size_t *size_bytes);

/* Makes such a GLB and imports it. */
MUST_CHECK bool imported_scene_make(struct imported_scene *imported, const char *json,
                                    const void *bin, size_t bin_bytes, struct error *err);

/* Reads a .glb, or a .gltf with every other file of its folder and below, and imports it. */
MUST_CHECK bool imported_scene_load(struct imported_scene *imported, const char *path,
                                    struct error *err);

/* The same for a path below the asset folder, e.g. "Box/glTF/Box.gltf". */
MUST_CHECK bool imported_asset_load(struct imported_scene *imported, const char *path,
                                    struct error *err);

/* False, after a message on standard error, when the asset folder is absent: the test is to be
 * skipped. */
bool assets_are_present(void);

/* Whole file in malloc'ed memory; NULL with err set. */
void *file_read(const char *path, size_t *size_bytes, struct error *err);

/* Whether some warning of the scene contains the text. */
bool scene_has_warning(const struct scene *scene, const char *text);

#endif

/* SPDX-License-Identifier: MIT */
/* Imports an uploaded glTF with its files into a scene blob. Thread: any. Runs inside the sandboxed
 * decoder: it opens no file, touches no network, and finds every URI only among the files it was
 * handed. */
#ifndef VITRAIL_RENDERER_IMPORT_IMPORT_H
#define VITRAIL_RENDERER_IMPORT_IMPORT_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct scene_file {
    const char *name;  /* relative name as uploaded, UTF-8, '/' separated; "" for a single GLB */
    const void *bytes; /* borrowed */
    size_t size_bytes;
};

struct scene_import_desc {
    const struct scene_file *files; /* required; one, by name or GLB magic, is the .gltf or .glb */
    size_t file_count;
    uint64_t max_blob_bytes;   /* 0 means 8 GiB */
    uint64_t max_image_pixels; /* per image; 0 means 64 Mi */
    const char *scene;         /* which of the file is shown: its name, else "#1", its index; NULL:
                                  the one that the file names, else its first */
    /* Optional: told of the scenes of the file, in their order. */
    bool (*tell_scene)(void *context, const char *name, bool is_shown, struct error *err);
    /* Optional: takes pixels at their offset in the blob, an image at a time, so that memory need
     * not hold them all. Only the blob's head comes back then (scene_open_head). Called on the
     * caller's thread. */
    bool (*write)(void *context, uint64_t offset_bytes, const void *bytes, size_t size_bytes,
                  struct error *err);
    void *context; /* for tell_scene and write */
};

/* Writes a new blob, or its head, to *blob (malloc'ed, caller frees). Errors: ERROR_INVALID_SCENE
 * naming file, element and reason; ERROR_UNSUPPORTED naming a required extension that is not known;
 * ERROR_INVALID_REQUEST for a scene that the file does not have; ERROR_TOO_LARGE; ERROR_NO_MEMORY.
 */
MUST_CHECK bool scene_import(const struct scene_import_desc *desc, void **blob, size_t *size_bytes,
                             struct error *err);

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: MIT */
/* Imports an uploaded scene with its files into a scene blob. Thread: any. Runs inside the
 * sandboxed decoder: it opens no file, touches no network, and finds every URI only among the files
 * it was handed. */
#ifndef VITRAIL_RENDERER_IMPORT_IMPORT_H
#define VITRAIL_RENDERER_IMPORT_IMPORT_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/scene_format.h"

#ifdef __cplusplus
extern "C" {
#endif

struct scene_file {
    const char *name;  /* relative name as uploaded, UTF-8, '/' separated; "" for a single GLB */
    const void *bytes; /* borrowed */
    size_t size_bytes;
};

/* In their order; IMAGES only where there are some, CONVERSION only of formats other than glTF. */
enum scene_import_stage {
    SCENE_IMPORT_CONVERSION, /* begins: its share is 0 to its end */
    SCENE_IMPORT_FILE,       /* reading the JSON of glTF; begins, likewise */
    SCENE_IMPORT_MESHES,
    SCENE_IMPORT_NODES,
    SCENE_IMPORT_IMAGES,
};

struct scene_import_desc {
    const struct scene_file *files; /* required; one, by name or GLB magic, is the .gltf or .glb, or
                                       by name that of the format */
    size_t file_count;
    enum scene_format format;  /* of the one that is the scene */
    double unit_m;             /* of a format other than glTF: metres of one unit of the file, above
                                  0; 0: what the file says, else 1 */
    char up;                   /* likewise: its axis that points up, 'y' or 'z'; 0: what the file
                                  says, else that of the format */
    double deflection;         /* of STEP and IGES: how far triangles may be off their surfaces, in
                                  units of the file, above 0; 0: 0.001 of the diagonal of a part */
    uint64_t max_blob_bytes;   /* 0 means 8 GiB */
    uint64_t max_image_pixels; /* per image; 0 means 64 Mi */
    const char *scene;         /* which of the file is shown: its name, else "#1", its index; NULL:
                                  the one that the file names, else its first */
    /* Optional: called for each scene of the file, in their order. */
    bool (*tell_scene)(void *context, const char *name, bool is_shown, struct error *err);
    /* Optional: called before the others, with how the files were read. */
    bool (*tell_origin)(void *context, const struct scene_origin *origin, struct error *err);
    /* Optional: takes pixels at their offset in the blob, an image at a time, so that memory need
     * not hold them all. Only the blob's head comes back then (scene_open_head). Several threads
     * call it at once, each for bytes of its own. */
    bool (*write)(void *context, uint64_t offset_bytes, const void *bytes, size_t size_bytes,
                  struct error *err);
    /* Optional: called often, with how far a stage is, in [0, 1]; on any thread, one at a time. */
    void (*advance)(void *context, enum scene_import_stage stage, double share);
    void *context; /* for tell_scene, tell_origin, write and advance */
};

/* Loads what reads files of a format, so that nothing is loaded later, where that is forbidden.
 * ERROR_UNSUPPORTED where it is not there. */
MUST_CHECK bool scene_import_prepare(enum scene_format format, struct error *err);

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

/* SPDX-License-Identifier: MIT */
/* A scene as a command line names it: a file on this machine, or a scene that the server has. */
#ifndef VITRAIL_CLIENTS_VITRAIL_SCENE_SOURCE_H
#define VITRAIL_CLIENTS_VITRAIL_SCENE_SOURCE_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/scene_reference.h"
#include "clients/vitrail/session.h"

struct scene_push {
    char id[SCENE_ID_BYTES];
    bool was_sent; /* false: the server had it, nothing but a question went over the wire */
};

/* Whether `text` means a scene of the server, and not a file that happens to be called so. */
bool scene_source_is_on_server(const char *text);

/* Makes sure that the file can be read and is GLB by its content, or a scene by its name or
 * content, before a server is started for it. */
bool scene_source_check(const char *path, struct failure *failure);

/* What a post asks for beside the file. */
struct file_options {
    const char *name;  /* what the scene is called; NULL: as its file, if it is new to the server */
    const char *scene; /* which of the file; NULL: the file's own choice */
    const char *unit;  /* of its coordinates, of a format other than glTF; NULL: as it tells */
    const char *up;    /* its axis that points up, likewise */
    const char *deflection; /* how far its triangles are off its surfaces, in its units, likewise */
    bool force;             /* send it without the question whether the server has it */
};

/* The options of a command that takes a FILE or a SCENE; its options have a file_options `file`. */
#define SCENE_FILE_OPTIONS(type)                                                                \
    {OPTION_TEXT,                                                                               \
     "scene",                                                                                   \
     0,                                                                                         \
     "NAME",                                                                                    \
     "which scene of the FILE, of OpenVDB which grid: its name,\nor #1, its index "             \
     "(default: the one that the file\nnames, or the grid density)",                            \
     offsetof(type, file.scene)},                                                               \
        {OPTION_TEXT,                                                                           \
         "unit",                                                                                \
         0,                                                                                     \
         "UNIT",                                                                                \
         "mm, cm, m, in or ft: of the FILE, if it is not glTF\n(default: as it tells, else m)", \
         offsetof(type, file.unit)},                                                            \
        {OPTION_TEXT,                                                                           \
         "up",                                                                                  \
         0,                                                                                     \
         "AXIS",                                                                                \
         "y or z: which axis of the FILE points up, if it is not\nglTF (default: as it "        \
         "tells, else y)",                                                                      \
         offsetof(type, file.up)},                                                              \
    {                                                                                           \
        OPTION_TEXT, "deflection", 0, "LENGTH",                                                 \
            "of STEP and IGES: how far triangles may be off their\nsurfaces, in units of the "  \
            "FILE (default: 0.001 of the\ndiagonal of a part)",                                 \
            offsetof(type, file.deflection)                                                     \
    }

/* Brings the file to the server unless it is there already. A GLB is sent as it is, a .gltf with
 * all files it needs as multipart/form-data. One scene of a file is asked for by sending it. */
bool scene_source_push(struct session *session, const char *path,
                       const struct file_options *options, struct scene_push *push,
                       struct failure *failure);

/* Has the server make its demo scene, called `name`, NULL: "demo"; one that it has keeps its name
 * then. */
bool scene_source_push_demo(struct session *session, const char *name, struct scene_push *push,
                            struct failure *failure);

/* Sends a scene that shows one density grid, as procedure_spec_parse has it, called `name`, NULL:
 * as the grid. */
bool scene_source_push_grid(struct session *session, const json_t *grid, const char *name,
                            struct scene_push *push, struct failure *failure);

/* scene_source_check() for `source`, unless it is NULL or on the server, and for the scenes of the
 * parts of `request` and its environment map likewise. An option for one scene of a file needs a
 * file. options: NULL: none. */
bool scene_source_check_all(const char *source, const struct file_options *options,
                            const json_t *request, struct failure *failure);

/* Brings the scenes of the parts of `request` that are files, and its environment map, and names
 * them by their ids. */
bool scene_source_bring_beside(struct session *session, json_t *request, struct failure *failure);

/* Makes sure that the server has what `source` names, and names it in `request` as
 * "scene"; those of its parts as well. options: of `source`, where it is a file. */
bool scene_source_bring(struct session *session, const char *source,
                        const struct file_options *options, json_t *request,
                        struct scene_push *push, struct failure *failure);

#endif

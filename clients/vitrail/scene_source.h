/* SPDX-License-Identifier: MIT */
/* A scene as a command line names it: a file on this machine, or an id that the server knows. */
#ifndef VITRAIL_CLIENTS_VITRAIL_SCENE_SOURCE_H
#define VITRAIL_CLIENTS_VITRAIL_SCENE_SOURCE_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/session.h"

enum { SCENE_ID_BYTES = 65 }; /* 64 hexadecimal digits: SHA-256 of the content */

struct scene_push {
    char id[SCENE_ID_BYTES];
    bool was_sent; /* false: the server had it, nothing but a question went over the wire */
};

/* Whether `text` has the form of a scene id: 64 lowercase hexadecimal digits. */
bool scene_id_is_valid(const char *text);

/* Whether `text` means a scene id, and not a file that happens to be called so. */
bool scene_source_is_id(const char *text);

/* Makes sure that the file can be read and is GLB or glTF by its content, before a server is
 * started for it. */
bool scene_source_check(const char *path, struct failure *failure);

/* Brings the file to the server unless it is there already; `force` skips the question. A GLB is
 * sent as it is, a .gltf with all files it needs as multipart/form-data. */
bool scene_source_push(struct session *session, const char *path, bool force,
                       struct scene_push *push, struct failure *failure);

/* scene_source_check() for `source`, unless it is NULL or an id, and for the scenes of the parts of
 * `request` likewise. */
bool scene_source_check_all(const char *source, const json_t *request, struct failure *failure);

/* Brings the scenes of the parts of `request` that are files, and names them by their ids. */
bool scene_source_bring_parts(struct session *session, json_t *request, struct failure *failure);

/* Makes sure that the server has what `source` names, a file or an id, and names it in `request` as
 * "scene"; those of its parts as well. `force` as above, for `source`. */
bool scene_source_bring(struct session *session, const char *source, bool force, json_t *request,
                        struct scene_push *push, struct failure *failure);

#endif

/* SPDX-License-Identifier: MIT */
/* A scene or an environment map of the server as a command line names it: by its id, by the first
 * digits of its id, or by its name. */
#ifndef VITRAIL_CLIENTS_VITRAIL_SCENE_REFERENCE_H
#define VITRAIL_CLIENTS_VITRAIL_SCENE_REFERENCE_H

#include <stdbool.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/session.h"

enum {
    SCENE_ID_BYTES = 65,       /* 64 hexadecimal digits: SHA-256 of the content */
    SCENE_ID_DIGITS_LEAST = 4, /* fewer digits do not name a scene */
};

/* Whether `text` has the form of a scene id: 64 lowercase hexadecimal digits. */
bool scene_id_is_valid(const char *text);

/* Whether `text` means a scene of the server where a file could be meant as well: "scene:" and what
 * scene_reference_resolve() takes, or 4 to 64 lowercase hexadecimal digits. */
bool scene_reference_is_plain(const char *text);

/* The id that `text` means. An id is taken as it is, without a question to the server. Else the
 * first digits of an id, or a name, with or without "scene:" before it, have to mean exactly one
 * scene of the server: EXIT_CODE_NO_INPUT for none, EXIT_CODE_USAGE for several, which are listed.
 */
bool scene_reference_resolve(struct session *session, const char *text, char id[SCENE_ID_BYTES],
                             struct failure *failure);

/* Likewise of environment maps, with "environment:". */
bool environment_reference_is_plain(const char *text);
bool environment_reference_resolve(struct session *session, const char *text,
                                   char id[SCENE_ID_BYTES], struct failure *failure);

#endif

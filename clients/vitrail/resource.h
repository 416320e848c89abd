/* SPDX-License-Identifier: MIT */
/* What scenes and environment maps have in common on their way to the server. */
#ifndef VITRAIL_CLIENTS_VITRAIL_RESOURCE_H
#define VITRAIL_CLIENTS_VITRAIL_RESOURCE_H

#include <stdbool.h>
#include <stdio.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/scene_reference.h"
#include "clients/vitrail/session.h"
#include "protocol/limits.h"

enum { RESOURCE_NAME_BYTES = LIMIT_FILE_NAME_BYTES + 1 };

/* A regular file, to be read; NULL with EXIT_CODE_NO_INPUT. */
FILE *resource_open(const char *path, struct failure *failure);

/* Hexadecimal SHA-256 of the file. Checks for signals: a scene may be gigabytes. */
bool resource_hash(struct session *session, const char *path, char id[SCENE_ID_BYTES],
                   struct failure *failure);

/* True in *answer when the server has it. folder: "scenes" or "environments". An answer other than
 * yes or no is left to the upload to explain. */
bool resource_is_there(struct session *session, const char *folder, const char *id, bool *answer,
                       struct failure *failure);

/* The id that an upload was answered with. task: "the scene 'FILE'". */
bool resource_read_id(const struct http_reply *reply, const char *task, char id[SCENE_ID_BYTES],
                      struct failure *failure);

bool resource_rename(struct session *session, const char *folder, const char *id, const char *name,
                     struct failure *failure);

/* Adds a member to the query of an address, its value escaped (RFC 3986, 2.1): all but the
 * unreserved characters as "%XX". Without a value, nothing. */
void resource_add_query(char *address, size_t address_bytes, const char *key, const char *value);

/* The name of a file without its folders, as the server takes names: not every name that a file may
 * have is UTF-8 without control characters. */
void resource_name_from_path(const char *path, char name[RESOURCE_NAME_BYTES]);

#endif

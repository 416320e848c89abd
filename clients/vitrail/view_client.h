/* SPDX-License-Identifier: MIT */
/* Views as the commands use them: made from a scene, patched, looked at. */
#ifndef VITRAIL_CLIENTS_VITRAIL_VIEW_CLIENT_H
#define VITRAIL_CLIENTS_VITRAIL_VIEW_CLIENT_H

#include <jansson.h>

#include "clients/vitrail/scene_source.h"

bool view_id_is_valid(const char *text, struct failure *failure); /* 16 hexadecimal digits */

/* Brings the scene (a file or an id), and makes a view of it with the members. options: of a file.
 * has_defaults: members that neither scene nor call say are those of scene_defaults.h. Takes
 * members, which may be NULL after a failure. The summary is a new reference; NULL on failure. */
json_t *view_client_make(struct session *session, const char *scene,
                         const struct file_options *options, bool has_defaults, json_t *members,
                         struct failure *failure);

/* Borrows the patch. */
bool view_client_patch(struct session *session, const char *id, const json_t *patch,
                       struct failure *failure);

bool view_client_delete(struct session *session, const char *id, struct failure *failure);

/* Writes the exact image to a file, whole or not at all; the format is that of its extension. query
 * is appended ("&aov=depth"), or "". */
bool view_client_save(struct session *session, const char *id, const char *query, const char *path,
                      struct failure *failure);

/* The value of ?format= by the extension, or NULL with a failure. */
const char *view_client_format(const char *path, struct failure *failure);

#endif

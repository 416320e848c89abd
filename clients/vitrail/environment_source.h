/* SPDX-License-Identifier: MIT */
/* An environment map as a command line names it: the one that is built in, a file on this machine,
 * or a map that the server has. */
#ifndef VITRAIL_CLIENTS_VITRAIL_ENVIRONMENT_SOURCE_H
#define VITRAIL_CLIENTS_VITRAIL_ENVIRONMENT_SOURCE_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/scene_source.h"

/* Whether the file is Radiance HDR or OpenEXR by its first bytes. */
bool environment_source_is_map(const char *path, bool *answer, struct failure *failure);

/* Brings the file to the server unless it is there already. options->scene is not used. */
bool environment_source_push(struct session *session, const char *path,
                             const struct file_options *options, struct scene_push *push,
                             struct failure *failure);

/* Makes sure that the map of `request`, if it is a file, can be read, before a server is started
 * for it. */
bool environment_source_check(const json_t *request, struct failure *failure);

/* Brings the map of `request` if it is a file, and names it by its id. */
bool environment_source_bring(struct session *session, json_t *request, struct failure *failure);

#endif

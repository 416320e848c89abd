/* SPDX-License-Identifier: MIT */
/* What comes with a message of the front: the files of scenes and environment maps that a request
 * needs. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_MESSAGE_FILES_H
#define VITRAIL_SERVER_WORKER_MESSAGE_FILES_H

#include "protocol/render_request.h"
#include "server/base/ipc.h"
#include "server/worker/mapped_environments.h"
#include "server/worker/mapped_scenes.h"

/* Where they are mapped. */
struct message_files {
    struct mapped_scenes *scenes;
    struct mapped_environments *environments;
};

/* Makes the scene of a request ready, those of its parts and its environment map. */
MUST_CHECK bool message_files_attach(const struct message_files *files,
                                     const struct ipc_message *message,
                                     const struct render_request *request, struct error *err);

/* Whether all that the message names is on the device. */
bool message_files_are_at_hand(const struct message_files *files, const json_t *message);

/* The file behind those, or -1. */
int message_files_reference(const struct ipc_message *message);

/* Drops what has one of the ids, an array. Between frames. */
void message_files_forget(const struct message_files *files, const json_t *ids);

#endif

/* SPDX-License-Identifier: MIT */
/* One command's conversation: signals, progress, a server chosen or spawned, and a client for it.
 */
#ifndef VITRAIL_CLIENTS_VITRAIL_SESSION_H
#define VITRAIL_CLIENTS_VITRAIL_SESSION_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/http.h"
#include "clients/vitrail/options.h"
#include "clients/vitrail/spawn.h"

/* Zeroed, or after end: nothing is open. */
struct session {
    const struct common_options *options; /* borrowed */
    struct interrupt interrupt;
    struct progress progress;
    struct spawned_server spawned;
    struct http_client *client;
    double deadline_s; /* of the whole call; 0: none */
    bool is_starting;  /* the spawned server may not have a device yet */
};

/* Chooses the server: --server, --spawn, $VITRAIL_SERVER, the default. A spawned one listens
 * afterwards; any other is not asked anything. */
bool session_begin(struct session *session, const struct common_options *options,
                   struct failure *failure);

/* Ends a spawned server and frees. Accepts zeroed and half-begun sessions. */
void session_end(struct session *session);

/* Until a spawned server has a device; at once for any other. */
bool session_wait_until_ready(struct session *session, struct failure *failure);

/* http_ask on the session's client. A spawned server takes scenes while it starts; all else waits
 * until it is ready. When it died meanwhile, the failure says so and why. */
bool session_ask(struct session *session, const struct http_request *request, const char *task,
                 struct http_reply *reply, struct failure *failure);

/* GET, and the answer as JSON. NULL on failure. */
json_t *session_get_json(struct session *session, const char *path, const char *task,
                         struct failure *failure);

/* The answer's body as JSON; NULL and a failure when it is none. */
json_t *reply_json(const struct http_reply *reply, const char *task, struct failure *failure);

#endif

/* SPDX-License-Identifier: MIT */
/* Requests for images, and uploads, with the progress that the server tells of them. */
#ifndef VITRAIL_CLIENTS_VITRAIL_RENDER_WATCH_H
#define VITRAIL_CLIENTS_VITRAIL_RENDER_WATCH_H

#include "clients/vitrail/session.h"

/* session_ask for an image: shown as rendering, then as receiving. While it is rendered, and
 * somebody is shown the progress, the server is asked how far it is. */
bool render_watch_ask(struct session *session, const struct http_request *request, const char *task,
                      struct http_reply *reply, struct failure *failure);

/* session_ask for an upload: shown as uploading, then as reading, of which the server likewise
 * tells how far it is. */
bool upload_watch_ask(struct session *session, const struct http_request *request, const char *task,
                      struct http_reply *reply, struct failure *failure);

#endif

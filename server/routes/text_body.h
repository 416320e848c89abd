/* SPDX-License-Identifier: MIT */
/* The body of a request, collected in memory. Thread: that of its exchange. */
#ifndef VITRAIL_SERVER_ROUTES_TEXT_BODY_H
#define VITRAIL_SERVER_ROUTES_TEXT_BODY_H

#include <stddef.h>

#include "server/http/http.h"

/* The value of Accept-Patch, also named by refusals. */
extern const char text_body_patch_types[];

/* Zeroed = empty. */
struct text_body {
    char *text; /* owned; not terminated; NULL when empty */
    size_t size_bytes, capacity;
};
void text_body_finish(struct text_body *body); /* accepts zeroed */

/* The sink for http_request_take_body; the body must stay where it is. */
struct http_body_sink text_body_sink(struct text_body *body, uint64_t max_bytes);

/* For the `open` of a route whose body is JSON: has the body collected and attached to the
 * exchange (route_attached), or refuses its Content-Type. `what` is the body's name in the refusal:
 * "a view". A patch may be application/merge-patch+json (RFC 7396), too. */
void text_body_open(struct http_exchange *exchange, const char *what, bool is_patch);

#endif

/* SPDX-License-Identifier: MIT */
/* The body of a request, collected in memory. Thread: that of its exchange. */
#ifndef VITRAIL_SERVER_TEXT_BODY_H
#define VITRAIL_SERVER_TEXT_BODY_H

#include <stddef.h>

#include "server/http.h"

/* Zeroed = empty. */
struct text_body {
    char *text; /* owned; not terminated; NULL when empty */
    size_t size_bytes, capacity;
};
void text_body_finish(struct text_body *body); /* accepts zeroed */

/* For http_request_take_body; the body must stay where it is. */
struct http_body_sink text_body_sink(struct text_body *body, uint64_t max_bytes);

#endif

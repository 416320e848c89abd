/* SPDX-License-Identifier: MIT */
/* A streaming parser of multipart/form-data (RFC 7578): bytes come in pieces of any size, parts go
 * out as events. It holds at most one line of a part's header and one boundary. Thread: any, one
 * parser on one thread at a time. */
#ifndef VITRAIL_SERVER_HTTP_MULTIPART_H
#define VITRAIL_SERVER_HTTP_MULTIPART_H

#include <stdbool.h>
#include <stddef.h>

#include "protocol/error.h"

/* The name and filename of a part as sent, with quotes and escapes undone; "" where absent. */
struct multipart_part {
    const char *name, *filename;
};

/* Each returns false, with err set, to stop. */
struct multipart_events {
    void *context;
    bool (*begin_part)(void *context, const struct multipart_part *part, struct error *err);
    bool (*data)(void *context, const void *bytes, size_t size_bytes, struct error *err);
    bool (*end_part)(void *context, struct error *err);
};

struct multipart;

/* content_type is the value of the Content-Type header; ERROR_INVALID_REQUEST when it brings no
 * usable boundary. */
struct multipart *multipart_create(const char *content_type, const struct multipart_events *events,
                                   struct error *err);
void multipart_destroy(struct multipart *multipart); /* accepts NULL */

MUST_CHECK bool multipart_write(struct multipart *multipart, const void *bytes, size_t size_bytes,
                                struct error *err);

/* The body is over: fails unless the closing boundary was seen. */
MUST_CHECK bool multipart_end(struct multipart *multipart, struct error *err);

#endif

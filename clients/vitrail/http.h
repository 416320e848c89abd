/* SPDX-License-Identifier: MIT */
/* Requests to one server. The only home of libcurl; one request at a time, and beside it looks at
 * how far its answer is. */
#ifndef VITRAIL_CLIENTS_VITRAIL_HTTP_H
#define VITRAIL_CLIENTS_VITRAIL_HTTP_H

#include <stdbool.h>
#include <stddef.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/interrupt.h"
#include "clients/vitrail/output_file.h"
#include "clients/vitrail/progress.h"

struct http_client;

struct http_client_desc {
    const char *base_url;        /* required; http or https, a path before /v1 is kept */
    struct interrupt *interrupt; /* required, borrowed for life */
    struct progress *progress;   /* borrowed for life; NULL is silent */
    double deadline_s;           /* on clock_s(); no request goes on past it; 0 means none */
};

struct http_client *http_client_create(const struct http_client_desc *desc,
                                       struct failure *failure);
void http_client_destroy(struct http_client *client);
/* For people: without user, password and the slash at its end. */
const char *http_client_url(const struct http_client *client);

/* One file of a multipart upload. */
struct http_part {
    char *name; /* relative, '/' between folders, UTF-8 */
    char *path; /* on this machine */
};

/* A document that is asked for twice a second at first, and later every other second, from when the
 * answer to a request lets itself be waited for until it begins to come. That it cannot be had is
 * no failure. */
struct http_side {
    const char *path;                              /* required */
    void (*take)(void *context, const char *body); /* required: each that came with 200 */
    void *context;
};

struct http_request {
    /* Required: "GET", "HEAD", "POST", "PATCH", "DELETE". */
    const char *method;
    const char *path;              /* required, from the first slash on, already escaped */
    const char *accept;            /* NULL means application/json */
    const char *content_type;      /* of body or body_path */
    const char *body;              /* a text; or ... */
    const char *body_path;         /* ... a file, streamed; or ... */
    const struct http_part *parts; /* ... files as multipart/form-data, streamed */
    size_t part_count;
    struct output_file *sink;     /* a 2xx body goes there instead of into the reply */
    const char *request_id;       /* X-Request-Id; NULL leaves it to the server */
    const char *idempotency_key;  /* NULL: none */
    const struct http_side *side; /* NULL: nothing is asked for beside it */
    enum progress_stage sending, waiting, receiving; /* 0: that part is not shown */
};

/* Zeroed = empty; http_reply_finish frees. */
struct http_reply {
    int status;
    char *body; /* owned, NUL after the end; NULL when empty or in the sink */
    size_t body_bytes;
    char content_type[128];
    char location[512]; /* or "" */
    char link[512];     /* the Link header, or "" */
    int retry_after_s;
};

/* True once an answer came, whatever its status. Otherwise nothing answered, it broke off, time ran
 * out, a signal came or the sink could not be written, and the failure says which. */
bool http_send(struct http_client *client, const struct http_request *request,
               struct http_reply *reply, struct failure *failure);

/* http_send, and an answer other than 2xx is a failure too; `task` as in struct failure_reply. */
bool http_ask(struct http_client *client, const struct http_request *request, const char *task,
              struct http_reply *reply, struct failure *failure);

/* The path of the frame's report that the Link header names; false: it names none that fits. */
bool http_reply_frame_path(const struct http_reply *reply, char *path, size_t capacity);

void http_reply_finish(struct http_reply *reply);

#endif

/* SPDX-License-Identifier: MIT */
/* A buffer that doubles, and the JSON bodies of routes. */
#include "server/routes/text_body.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "server/http/negotiate.h"
#include "server/routes/router.h"

enum { FIRST_PIECE_BYTES = 4096 };

static bool take_piece(void *context, const void *bytes, size_t size_bytes, struct error *err)
{
    struct text_body *body = context;
    if (size_bytes > body->capacity - body->size_bytes) {
        size_t capacity = 2 * (body->size_bytes + size_bytes);
        if (capacity < FIRST_PIECE_BYTES)
            capacity = FIRST_PIECE_BYTES;
        char *text = realloc(body->text, capacity);
        if (!text)
            return error_set(err, ERROR_NO_MEMORY, "request of %zu bytes", capacity);
        body->text = text;
        body->capacity = capacity;
    }
    memcpy(body->text + body->size_bytes, bytes, size_bytes);
    body->size_bytes += size_bytes;
    return true;
}

void text_body_finish(struct text_body *body)
{
    free(body->text);
    *body = (struct text_body){0};
}

struct http_body_sink text_body_sink(struct text_body *body, uint64_t max_bytes)
{
    return (struct http_body_sink){.context = body, .write = take_piece, .max_bytes = max_bytes};
}

const char text_body_patch_types[] = "application/merge-patch+json, application/json";

static void body_destroy(void *data)
{
    text_body_finish(data);
    free(data);
}

void text_body_open(struct http_exchange *exchange, const char *what, bool is_patch)
{
    struct error problem = {0};
    const char *type = http_request_header(exchange, "Content-Type");
    bool is_json = negotiate_is_type(type, "application/json") ||
                   (is_patch && negotiate_is_type(type, "application/merge-patch+json"));
    struct text_body *body = is_json ? calloc(1, sizeof *body) : NULL;
    if (!body) {
        if (is_json)
            error_set(&problem, ERROR_NO_MEMORY, "request");
        else
            error_set(&problem, ERROR_UNSUPPORTED_MEDIA_TYPE, "Content-Type '%.80s': %s is %s",
                      type ? type : "", what,
                      is_patch ? text_body_patch_types : "application/json");
        if (is_patch)
            http_reply_header(exchange, "Accept-Patch", "%s", text_body_patch_types);
        http_reply_error(exchange, &problem);
        return;
    }
    route_attach(exchange, body, body_destroy);
    struct http_body_sink sink = text_body_sink(body, LIMIT_REQUEST_JSON_BYTES);
    http_request_take_body(exchange, &sink);
}

/* SPDX-License-Identifier: MIT */
/* A buffer that doubles. */
#include "server/text_body.h"

#include <stdlib.h>
#include <string.h>

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

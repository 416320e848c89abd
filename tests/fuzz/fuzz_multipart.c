/* SPDX-License-Identifier: MIT */
/* Fuzz target: a multipart body, whole and in pieces, gives the same parts or is refused both
 * times.
 *
 * Input: one byte that chooses the size of the pieces, then the body; its boundary is "b". */
#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/multipart.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A running hash of the events, FNV-1a: data counts byte by byte, however it was cut. */
struct trace {
    uint64_t hash;
    bool is_in_part;
};

static void add(struct trace *trace, const void *bytes, size_t size_bytes)
{
    for (size_t i = 0; i < size_bytes; i++)
        trace->hash = (trace->hash ^ ((const uint8_t *)bytes)[i]) * 0x100000001b3u;
}

static bool on_part(void *context, const struct multipart_part *part, struct error *err)
{
    (void)err;
    struct trace *trace = context;
    assert(!trace->is_in_part);
    trace->is_in_part = true;
    add(trace, "[", 1);
    add(trace, part->name, strlen(part->name) + 1);
    add(trace, part->filename, strlen(part->filename) + 1);
    return true;
}

static bool on_data(void *context, const void *bytes, size_t size_bytes, struct error *err)
{
    (void)err;
    struct trace *trace = context;
    assert(trace->is_in_part && size_bytes > 0);
    add(trace, bytes, size_bytes);
    return true;
}

static bool on_end(void *context, struct error *err)
{
    (void)err;
    struct trace *trace = context;
    assert(trace->is_in_part);
    trace->is_in_part = false;
    add(trace, "]", 1);
    return true;
}

static bool parse(const uint8_t *body, size_t size, size_t piece, struct trace *trace)
{
    struct error err = {0};
    const struct multipart_events events = {trace, on_part, on_data, on_end};
    struct multipart *multipart = multipart_create("multipart/form-data;boundary=b", &events, &err);
    assert(multipart);
    bool is_good = true;
    for (size_t at = 0; is_good && at < size; at += piece) {
        size_t length = size - at < piece ? size - at : piece;
        void *copy = malloc(length); /* so that a sanitizer sees reads beyond a piece */
        assert(copy);
        memcpy(copy, body + at, length);
        is_good = multipart_write(multipart, copy, length, &err);
        free(copy);
    }
    is_good = is_good && multipart_end(multipart, &err);
    assert(is_good == (err.code == ERROR_NONE));
    multipart_destroy(multipart);
    return is_good;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 1)
        return 0;
    struct trace whole = {.hash = 0xcbf29ce484222325u}, pieces = whole;
    bool is_good = parse(data + 1, size - 1, size, &whole);
    bool is_good_too = parse(data + 1, size - 1, 1 + data[0] % 16, &pieces);
    assert(is_good == is_good_too);
    assert(!is_good || whole.hash == pieces.hash);
    return 0;
}

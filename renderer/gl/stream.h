/* SPDX-License-Identifier: MIT */
/* A buffer for what the host gives to the device frame by frame: written from its start to its end,
 * and then from its start again, so that a write seldom meets what the device still reads. Thread:
 * GL. */
#ifndef VITRAIL_RENDERER_GL_STREAM_H
#define VITRAIL_RENDERER_GL_STREAM_H

#include "renderer/gl/object.h"

struct gl_stream { /* zeroed = empty */
    struct gl_buffer buffer;
    uint64_t used_bytes;
};

struct gl_stream_desc {
    const char *label; /* required */
    /* Required; from here on it is written from its start: one piece may be larger. */
    uint64_t kept_bytes;
    uint64_t align_bytes; /* of pieces; 0 means 16 */
};

/* Puts a piece on the device and says where. Earlier pieces are there until the stream begins
 * again, and then for all that was submitted before; the buffer may be another one. */
MUST_CHECK bool gl_stream_write(struct gl_stream *stream, const struct gl_stream_desc *desc,
                                const void *data, uint64_t size_bytes, uint64_t *offset_bytes,
                                struct error *err);
void gl_stream_finish(struct gl_stream *stream);

#endif

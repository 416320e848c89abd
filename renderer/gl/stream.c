/* SPDX-License-Identifier: MIT */
/* Writes pieces into a buffer one after the other. */
#include "renderer/gl/stream.h"

bool gl_stream_write(struct gl_stream *stream, const struct gl_stream_desc *desc, const void *data,
                     uint64_t size_bytes, uint64_t *offset_bytes, struct error *err)
{
    uint64_t align = desc->align_bytes ? desc->align_bytes : 16;
    uint64_t offset = (stream->used_bytes + align - 1) / align * align;
    if (offset + size_bytes > desc->kept_bytes)
        offset = 0;
    if (!gl_buffer_reserve(&stream->buffer,
                           &(struct gl_buffer_desc){.label = desc->label,
                                                    .size_bytes = offset + size_bytes,
                                                    .is_uploaded = true},
                           true, err))
        return false;
    gl_buffer_write(&stream->buffer, offset, size_bytes, data);
    stream->used_bytes = offset + size_bytes;
    *offset_bytes = offset;
    return true;
}

void gl_stream_finish(struct gl_stream *stream)
{
    gl_buffer_finish(&stream->buffer);
    *stream = (struct gl_stream){.used_bytes = 0};
}

/* SPDX-License-Identifier: MIT */
/* Fills large parts of buffers, on graphics hardware by a dispatch. glClearNamedBufferSubData
 * leaves that to the driver, and Mesa's iris and crocus have the processor write every word.
 * Thread: GL. */
#ifndef VITRAIL_RENDERER_GL_BUFFER_FILL_H
#define VITRAIL_RENDERER_GL_BUFFER_FILL_H

#include "renderer/gl/context.h"
#include "renderer/gl/object.h"
#include "renderer/gl/program_list.h"

struct buffer_fill_desc {
    struct program_cache *programs;    /* required */
    const struct gl_limits *limits;    /* required but by GL; what a storage block holds */
    struct gl_buffer *buffer;          /* required */
    uint64_t offset_bytes, size_bytes; /* multiples of 4, within the buffer */
    uint32_t value;                    /* of each word */
    bool by_gl; /* as gl_buffer_clear_u32 does: in software, whose processors are as quick at it */
};

/* Behind all that shaders wrote before, and before all that shaders write or read there from here
 * on through storage blocks, as gl_buffer_clear_u32. Changes the program in use and the binding
 * BIND_FILLED, but by GL. */
MUST_CHECK bool buffer_fill_u32(const struct buffer_fill_desc *desc, struct error *err);

/* Its program, for certain. Thread: any. */
void buffer_fill_list_programs(const char *pass, struct program_list *list);

#endif

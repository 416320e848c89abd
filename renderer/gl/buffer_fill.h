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

/* Fills the range, ordered after all earlier writes of shaders and before all later accesses
 * through storage blocks, as gl_buffer_clear_u32 is. Changes the program in use and the binding
 * BIND_FILLED, unless GL fills it. */
MUST_CHECK bool buffer_fill_u32(const struct buffer_fill_desc *desc, struct error *err);

/* Lists the program of a fill, as one that is certainly needed. Thread: any. */
void buffer_fill_list_programs(const char *pass, struct program_list *list);

#endif

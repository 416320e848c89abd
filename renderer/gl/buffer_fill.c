/* SPDX-License-Identifier: MIT */
/* A dispatch for each part of a buffer that one storage block holds. */
#include "renderer/gl/buffer_fill.h"

#include <assert.h>
#include <epoxy/gl.h>

#include "shaders/shared/bindings.h"

enum {
    GROUP_WORDS = 1024,   /* of buffer_fill.comp.glsl: 64 threads of 16 words */
    PART_BYTES = 1 << 27, /* 32,768 groups; every device has 65,535 */
};

static const struct program_desc fill_program = {.label = "buffer_fill",
                                                 .compute = "buffer_fill.comp.glsl"};

void buffer_fill_list_programs(const char *pass, struct program_list *list)
{
    program_list_add(list, pass, &fill_program, false);
}

static uint64_t part_bytes(const struct gl_limits *limits)
{
    uint64_t most = gl_limits_block(limits, GL_BUFFER_ALIGNMENT) * GL_BUFFER_ALIGNMENT;
    return most < PART_BYTES ? most : PART_BYTES;
}

bool buffer_fill_u32(const struct buffer_fill_desc *desc, struct error *err)
{
    uint64_t end = desc->offset_bytes + desc->size_bytes;
    assert(desc->offset_bytes % 4 == 0 && desc->size_bytes % 4 == 0);
    assert(end <= desc->buffer->size_bytes);
    if (desc->by_gl) {
        gl_buffer_clear_u32(desc->buffer, desc->offset_bytes, desc->size_bytes, desc->value);
        return true;
    }
    uint64_t most = part_bytes(desc->limits);
    const struct gl_program *program = program_cache_get(desc->programs, &fill_program, err);
    if (!program)
        return false;
    gl_program_use(program);
    gl_program_set_u(program, "u_value", desc->value);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    for (uint64_t at = desc->offset_bytes; at < end;) {
        uint64_t first = at - at % GL_BUFFER_ALIGNMENT;
        uint64_t part_end = end - first < most ? end : first + most;
        uint32_t words = (uint32_t)((part_end - at) / 4);
        gl_buffer_bind_storage_range(desc->buffer, first, part_end - first, BIND_FILLED);
        gl_program_set_u(program, "u_first", (uint32_t)((at - first) / 4));
        gl_program_set_u(program, "u_count", words);
        glDispatchCompute((words + GROUP_WORDS - 1) / GROUP_WORDS, 1, 1);
        at = part_end;
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return true;
}

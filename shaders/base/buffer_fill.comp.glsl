// SPDX-License-Identifier: MIT
// Words of a buffer become one value (renderer/gl/buffer_fill.c).
#include "shared/bindings.h"

layout(local_size_x = 64) in;
layout(std430, binding = BIND_FILLED) writeonly buffer filled_block { uint words[]; };
uniform uint u_first, u_count; // words: the first one, and their number
uniform uint u_value;

const uint EACH = 16u; // words of a thread, a group apart

void main()
{
    uint at = gl_WorkGroupID.x * (gl_WorkGroupSize.x * EACH) + gl_LocalInvocationID.x;
    for (uint i = 0u; i < EACH; i++) {
        if (at < u_count)
            words[u_first + at] = u_value;
        at += gl_WorkGroupSize.x;
    }
}

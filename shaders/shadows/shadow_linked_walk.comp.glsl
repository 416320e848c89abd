// SPDX-License-Identifier: MIT
// Walks finished linked shadow lists, one per thread: lengths for the report, and the proof that
// they are sorted and unlocked. At most 60,000 elements of a list are visited (llvmpipe's loop
// limit).
#include "shared/bindings.h"
#include "shadows/shadow_element.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = BIND_SHADOW_COUNTS) readonly buffer head_buffer { uint heads[]; };
layout(std430, binding = BIND_LIST_NODES) readonly buffer node_buffer { uvec4 nodes[]; };
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };

uniform uint u_first, u_count; // heads of the light
uniform uint u_node_base;
uniform uint u_slot;           // (elements, longest, occupied, lists out of order)

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint thread = group * 64u + gl_LocalInvocationID.x;
    if (thread >= u_count)
        return;
    uint next = heads[u_first + thread], length_ = 0u;
    float before = -3.0e38;
    bool is_sorted = true;
    for (; next < ELEMENT_LOCKED && length_ < 60000u; length_++) {
        uvec4 node = nodes[u_node_base + next];
        float depth = uintBitsToFloat(node.x);
        is_sorted = is_sorted && depth >= before;
        before = depth;
        next = node.w;
    }
    if (next != ELEMENT_END || !is_sorted)
        atomicAdd(statistics[u_slot * 4u + 3u], 1u);
    if (length_ == 0u)
        return;
    atomicAdd(statistics[u_slot * 4u], length_);
    atomicMax(statistics[u_slot * 4u + 1u], length_);
    atomicAdd(statistics[u_slot * 4u + 2u], 1u);
}

// SPDX-License-Identifier: MIT
// A list of pixels and their samples (apart_lists.glsl), a thread for each: mostly those whose
// samples are shaded apart.
// Needs: shared/bindings.h, shared/contrast.h, groups of 64 threads. Provides: apart_take.
layout(std430, binding = BIND_APART) readonly buffer apart_buffer {
    uint apart_groups[3], apart_count, apart_unused[APART_HEAD_WORDS - 4], apart_pixels[];
};
uniform uint u_first; // a multiple of 64

// The thread's pixel; returns its samples, 0 behind the end of the list.
uint apart_take(out uvec2 at)
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint entry = u_first + group * 64u + gl_LocalInvocationIndex;
    uint word = entry < apart_count ? apart_pixels[entry] : 0u;
    at = uvec2(word, word >> APART_SIDE_BITS) & ((1u << APART_SIDE_BITS) - 1u);
    return word >> 2 * APART_SIDE_BITS;
}

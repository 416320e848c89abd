// SPDX-License-Identifier: MIT
// The lists of pixels that light_contrast.comp.glsl and light_apart.comp.glsl make, each with a
// thread for each pixel of its reader.
// Needs: shared/bindings.h, shared/contrast.h. Provides: apart_word, APPEND.
#define CANDIDATE 1u
#define CANDIDATE_UNKNOWN 2u // a neighbour is in another window
layout(std430, binding = BIND_STATISTICS) buffer head_buffer {
    uint candidate_groups[3], candidate_count; // of the reader's dispatch; pixels
    uint apart_groups[3], apart_count;
};

uint apart_word(ivec2 pixel, uint samples)
{
    return uint(pixel.x) | uint(pixel.y) << APART_SIDE_BITS | samples << 2 * APART_SIDE_BITS;
}

#define APPEND(list, groups, count, word) { \
        uint at = atomicAdd(count, 1u); \
        list[at] = word; \
        if ((at & 63u) == 0u) { \
            atomicAdd(groups[0], 1u); \
            groups[1] = groups[2] = 1u; \
        } \
    }

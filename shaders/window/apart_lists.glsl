// SPDX-License-Identifier: MIT
// The lists of pixels that light_contrast.comp.glsl and light_apart.comp.glsl make, each with a
// thread for each pixel of its reader (apart.glsl).
// Needs: shared/bindings.h, shared/contrast.h, LIST_BINDING. Provides: apart_word, list_append.
#define CANDIDATE 1u
#define CANDIDATE_UNKNOWN 2u // a neighbour is in another window
layout(std430, binding = LIST_BINDING) buffer list_buffer {
    uint list_groups[3], list_count, list_unused[APART_HEAD_WORDS - 4], list_pixels[];
};

uint apart_word(ivec2 pixel, uint samples)
{
    return uint(pixel.x) | uint(pixel.y) << APART_SIDE_BITS | samples << 2 * APART_SIDE_BITS;
}

void list_append(uint word)
{
    uint at = atomicAdd(list_count, 1u);
    list_pixels[at] = word;
    if ((at & 63u) == 0u) {
        atomicAdd(list_groups[0], 1u);
        list_groups[1] = list_groups[2] = 1u;
    }
}

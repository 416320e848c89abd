// SPDX-License-Identifier: MIT
// Provides: the heads and elements of light linked lists under construction, and allocation.
// Lindbeck 2015, 1.2: one head per tile, 16-byte elements, one counter.
#include "shared/bindings.h"
#include "lll_tiles.glsl"

#define LLL_END 0xffffffffu
#define LLL_LOCKED 0xfffffffeu
#define LLL_HEADER 4u
// Steps of a walk along a list. llvmpipe ends all loops of an invocation silently after 65,535
// steps together.
#define LLL_STEPS 30000

struct lll_element {
    float front, back;
    uint light;
    uint next;
};

layout(std430, binding = BIND_LIGHT_HEADS) coherent volatile buffer lll_heads {
    uint element_count; // asked for; above u_capacity: lost, and the build is repeated with room
    uint failure_count; // insertions that ran out of steps or tries
    uint header_pad[2];
    uint heads[];
};
layout(std430, binding = BIND_LIST_NODES) coherent buffer lll_elements { lll_element elements[]; };

uniform uint u_capacity; // elements in the pool

uint lll_list()
{
    return uint(gl_FragCoord.y) * uint(u_tiles.x) + uint(gl_FragCoord.x);
}

// Index of a new element, or LLL_END when the pool is full.
uint lll_allocate(float front, float back, uint light)
{
    uint at = atomicAdd(element_count, 1u);
    if (at >= u_capacity)
        return LLL_END;
    elements[at].front = front;
    elements[at].back = back;
    elements[at].light = light;
    return at;
}

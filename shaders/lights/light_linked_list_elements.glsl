// SPDX-License-Identifier: MIT
// Provides: the heads and elements of light linked lists under construction, and allocation.
// Lindbeck 2015, 1.2: one head per tile, 16-byte elements, one counter.
#include "shared/bindings.h"
#include "lights/light_linked_list_tiles.glsl"

#define LIGHT_LINKED_LIST_END 0xffffffffu
#define LIGHT_LINKED_LIST_LOCKED 0xfffffffeu
#define LIGHT_LINKED_LIST_HEADER 4u
// Steps of a walk along a list. llvmpipe ends all loops of an invocation silently after 65,535
// steps together.
#define LIGHT_LINKED_LIST_STEPS 30000

struct light_linked_list_element {
    float front, back;
    uint light;
    uint next;
};

layout(std430, binding = BIND_LIGHT_HEADS) coherent volatile buffer light_linked_list_heads {
    uint element_count; // asked for; above u_capacity: lost, and the build is repeated with room
    uint failure_count; // insertions that ran out of steps or tries
    uint header_pad[2];
    uint heads[];
};
layout(std430, binding = BIND_LIST_NODES) coherent buffer light_linked_list_elements {
    light_linked_list_element elements[];
};

uniform uint u_capacity; // elements in the pool

uint light_linked_list_list()
{
    return uint(gl_FragCoord.y) * uint(u_tiles.x) + uint(gl_FragCoord.x);
}

// Index of a new element, or LIGHT_LINKED_LIST_END when the pool is full.
uint light_linked_list_allocate(float front, float back, uint light)
{
    uint at = atomicAdd(element_count, 1u);
    if (at >= u_capacity)
        return LIGHT_LINKED_LIST_END;
    elements[at].front = front;
    elements[at].back = back;
    elements[at].light = light;
    return at;
}

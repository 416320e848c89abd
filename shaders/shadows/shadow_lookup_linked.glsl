// SPDX-License-Identifier: MIT
// Lookups in linked lists that are sorted by depth (Lindbeck 2015, 3.2). SHADOW_FAITHFUL: their
// elements as published. Provides: shadow_run_linked, shadow_list_linked (shadow_lists.glsl)
#include "shadows/shadow_run.glsl"
#include "shadows/shadow_element.glsl"
layout(binding = UNIT_SHADOW_NODES) uniform usamplerBuffer u_shadow_nodes;

#ifdef SHADOW_FAITHFUL
// reach: the depth that opaque elements are compared with.
vec3 shadow_linked(shadow_run run, uint node_base, float depth, float reach, uint object)
{
    vec3 t = vec3(1.0);
    uint next = uint(run.begin);
    while (next < ELEMENT_LOCKED) {
        uvec4 node = texelFetch(u_shadow_nodes, int(node_base + next));
        float before = (element_is_opaque(node) ? reach : depth) - uintBitsToFloat(node.x);
        if (before > 0.0 && !element_is_of(node, object))
            t *= element_transmittance(node, before);
        if (!(max(depth, reach) > uintBitsToFloat(node.x)))
            break;
        next = node.w;
    }
    return t;
}
#else
vec3 shadow_linked(shadow_run run, uint node_base, float depth, float reach, uint object)
{
    vec3 t = vec3(1.0);
    uint next = uint(run.begin);
    while (next < ELEMENT_LOCKED) {
        uvec4 node = texelFetch(u_shadow_nodes, int(node_base + next));
        float before = depth - uintBitsToFloat(node.x);
        if (!(before > 0.0))
            break;
        if (!element_is_of(node, object))
            t *= element_transmittance(node, before);
        next = node.w;
    }
    return t;
}
#endif

bool shadow_run_linked(uint flags, uint head, uint event_base, out shadow_run run)
{
    uint first = texelFetch(u_shadow_heads, int(head)).r;
    run = shadow_run(int(first), 0);
    return first < ELEMENT_LOCKED;
}

vec3 shadow_list_linked(shadow_run run, shadow_look look)
{
    return shadow_linked(run, look.event_base, look.depth, look.reach, look.object);
}

// SPDX-License-Identifier: MIT
// Deep shadow maps as linked lists with a lock per list and sorted insertion (Lindbeck 2015, 3.2).
//   SHADOW_FAITHFUL  as published: opaque casters are elements of zero transmittance (OPAQUE) that
//                    unlink what is behind
//   otherwise        opaque casters stand in the depth map, and equal depths are ordered by colour,
//                    so that lists do not depend on the order of drawing
// The lock is the head itself. The critical section stands inside the loop, so that a lane that
// owns the lock never waits for lanes of its group that do not; tries are bounded, and a drop that
// failed is counted, never silent.
#include "shadow_caster.glsl"
#include "shadow_element.glsl"

#ifndef SHADOW_FAITHFUL
layout(early_fragment_tests) in;
#endif

layout(std430, binding = BIND_SHADOW_COUNTS) coherent buffer head_buffer { uint heads[]; };
layout(std430, binding = BIND_LIST_NODES) coherent buffer node_buffer { uvec4 nodes[]; };
layout(std430, binding = BIND_STATISTICS) coherent buffer statistics_buffer { uint statistics[]; };

const int TRIES = 4096;

bool comes_before(uvec4 a, uvec4 b)
{
    if (a.x != b.x)
        return uintBitsToFloat(a.x) < uintBitsToFloat(b.x);
#ifdef SHADOW_FAITHFUL
    return false;
#else
    return a.y != b.y ? a.y < b.y : a.z < b.z;
#endif
}

bool is_opaque(uvec4 element)
{
    return element_color(element) == vec3(0.0);
}

// Returns the list's head after the insertion.
uint insert(uint head, uvec4 element, bool cast_once)
{
    uint previous = ELEMENT_END, next = head;
    uvec4 before = uvec4(0u), after = uvec4(0u);
    while (next != ELEMENT_END) {
        after = nodes[FACE.event_base + next];
        if (!comes_before(after, element))
            break;
        if (is_opaque(after))
            return head; // no light gets here
        previous = next;
        before = after;
        next = after.w;
    }
    uint object = element_object(element);
    bool is_repeated = (previous != ELEMENT_END && element_object(before) == object) ||
                       (next != ELEMENT_END && element_object(after) == object);
    if (cast_once && is_repeated)
        return head;
    uint place = atomicAdd(statistics[FACE.slot * 2u], 1u);
    if (place >= FACE.event_count)
        return head;
#ifdef SHADOW_FAITHFUL
    // what is behind an opaque element is unlinked; its memory stays lost
    element.w = is_opaque(element) ? ELEMENT_END : next;
#else
    element.w = next;
#endif
    nodes[FACE.event_base + place] = element;
    if (previous == ELEMENT_END)
        return place;
    nodes[FACE.event_base + previous].w = place;
    return head;
}

void main()
{
#ifdef OPAQUE
    vec3 t = vec3(0.0);
    uint m = v_draw.x;
    bool is_kept = (materials[m].flags & MATERIAL_MASK) == 0u ||
                   caster_base(m).a >= materials[m].emissive_alpha_cutoff.w;
#else
    vec3 t = caster_transmittance();
    bool is_kept = t != vec3(1.0);
#endif
    if (gl_HelperInvocation || !is_kept)
        return;
    uvec2 at = uvec2(gl_FragCoord.xy);
    uint texel = FACE.first_count + at.y * FACE.resolution + at.x;
    bool cast_once = (materials[v_draw.x].flags & MATERIAL_CAST_ONCE) != 0u;
    uvec4 element = element_make(caster_depth(), t, v_draw.y, ELEMENT_END);
    bool is_done = false;
    for (int i = 0; i < TRIES && !is_done; i++) {
        uint head = atomicExchange(heads[texel], ELEMENT_LOCKED);
        if (head != ELEMENT_LOCKED) {
            head = insert(head, element, cast_once);
            memoryBarrierBuffer();
            atomicExchange(heads[texel], head);
            is_done = true;
        }
    }
    if (!is_done)
        atomicAdd(statistics[FACE.slot * 2u + 1u], 1u);
}

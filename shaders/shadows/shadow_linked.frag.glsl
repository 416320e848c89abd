// SPDX-License-Identifier: MIT
// Deep shadow maps as linked lists with sorted insertion (Lindbeck 2015, 3.2).
//   SHADOW_FAITHFUL  as published: opaque casters are elements of zero transmittance (OPAQUE) that
//                    unlink what is behind, and each list has a lock, which is the head itself
//   otherwise        opaque casters stand in the depth map, and equal depths are ordered by colour,
//                    so that lists do not depend on the order of drawing
//   UNLOCKED         as published, but for the lock
// Without a lock, an element is linked by compare and swap (Harris 2001, "A pragmatic
// implementation of non-blocking linked-lists", without deletion): no lane waits for another, and a
// race is lost only to an element that was linked. Tries for a lock are bounded; a drop of light
// whose tries ran out is counted, never silent, and its light is made again without locks.
#include "shadows/shadow_caster.glsl"
#include "shadows/shadow_element.glsl"

#if defined(SHADOW_FAITHFUL) && !defined(UNLOCKED)
#define HAS_LOCKS
#include "base/spin.glsl"
#endif

#ifndef SHADOW_FAITHFUL
layout(early_fragment_tests) in;
#endif

layout(std430, binding = BIND_SHADOW_COUNTS) coherent volatile buffer head_buffer { uint heads[]; };
layout(std430, binding = BIND_LIST_NODES) coherent buffer node_buffer { uvec4 nodes[]; };
layout(std430, binding = BIND_STATISTICS) coherent buffer statistics_buffer { uint statistics[]; };

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

// The elements before and after the place of the new one, ELEMENT_END where there is none.
struct gap {
    uint previous, next;
    uvec4 before, after;
};

bool is_repeated(gap g, uint object)
{
    return (g.previous != ELEMENT_END && element_object(g.before) == object) ||
           (g.next != ELEMENT_END && element_object(g.after) == object);
}

// ELEMENT_END: there is no room.
uint take_place()
{
    uint place = atomicAdd(statistics[FACE.slot * 2u], 1u);
    return place < FACE.event_count ? place : ELEMENT_END;
}

void store(uint place, uvec4 element, uint next)
{
#ifdef SHADOW_FAITHFUL
    // what is behind an opaque element is unlinked; its memory stays lost
    element.w = is_opaque(element) ? ELEMENT_END : next;
#else
    element.w = next;
#endif
    nodes[FACE.event_base + place] = element;
}

#ifdef HAS_LOCKS
// Returns the list's head after the insertion.
uint insert(uint head, uvec4 element, bool cast_once)
{
    gap g = gap(ELEMENT_END, head, uvec4(0u), uvec4(0u));
    while (g.next != ELEMENT_END) {
        g.after = nodes[FACE.event_base + g.next];
        if (!comes_before(g.after, element))
            break;
        if (is_opaque(g.after))
            return head; // no light gets here
        g.previous = g.next;
        g.before = g.after;
        g.next = g.after.w;
    }
    if (cast_once && is_repeated(g, element_object(element)))
        return head;
    uint place = take_place();
    if (place == ELEMENT_END)
        return head;
    store(place, element, g.next);
    if (g.previous == ELEMENT_END)
        return place;
    nodes[FACE.event_base + g.previous].w = place;
    return head;
}

// False: all tries found the list locked.
bool add_to_list(uint texel, uvec4 element, bool cast_once)
{
    bool is_done = false;
    spin s = spin(0u, 0u);
    while (!is_done && s.tries < FACE.lock_tries) {
        if (spin_pauses(s) || heads[texel] == ELEMENT_LOCKED)
            continue;
        uint head = atomicExchange(heads[texel], ELEMENT_LOCKED);
        if (head != ELEMENT_LOCKED) {
            head = insert(head, element, cast_once);
            memoryBarrierBuffer();
            atomicExchange(heads[texel], head);
            is_done = true;
        }
    }
    return is_done;
}
#else
// Each step passes an element or loses a race to one: the loop ends with the list. An element that
// is passed after its place was unlinked lies behind an opaque one, and so does the new one. The
// place of an element that turns out to be a repetition after a lost race stays lost. False: the
// device ended the loop before, as llvmpipe does after 65,535 steps.
bool add_to_list(uint texel, uvec4 element, bool cast_once)
{
    gap g = gap(ELEMENT_END, heads[texel], uvec4(0u), uvec4(0u));
    uint place = ELEMENT_END;
    bool is_done = false;
    while (!is_done) {
        if (g.next != ELEMENT_END) {
            g.after = nodes[FACE.event_base + g.next];
            if (comes_before(g.after, element)) {
                is_done = is_opaque(g.after); // no light gets here
                g.previous = g.next;
                g.before = g.after;
                g.next = g.after.w;
                continue;
            }
        }
        if (cast_once && is_repeated(g, element_object(element)))
            return true;
        if (place == ELEMENT_END)
            place = take_place();
        if (place == ELEMENT_END)
            return true;
        store(place, element, g.next);
        memoryBarrierBuffer();
        uint found = g.previous == ELEMENT_END
                         ? atomicCompSwap(heads[texel], g.next, place)
                         : atomicCompSwap(nodes[FACE.event_base + g.previous].w, g.next, place);
        is_done = found == g.next;
        g.next = found; // lost the race: go on from whatever came in between
    }
    return is_done;
}
#endif

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
    if (!add_to_list(texel, element, cast_once))
        atomicAdd(statistics[FACE.slot * 2u + 1u], 1u);
}

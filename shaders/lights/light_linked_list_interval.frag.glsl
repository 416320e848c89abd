// SPDX-License-Identifier: MIT
// Corrected light linked lists: an analytic, conservative depth interval per tile, inserted without
// a lock, sorted by (front, light), so that lists do not depend on the order of arrival.
// Insertion: Harris 2001, "A pragmatic implementation of non-blocking linked-lists", without
// deletion.
#include "lights/light_linked_list_light.glsl"
#include "lights/light_linked_list_elements.glsl"
#include "lights/light_linked_list_interval.glsl"

flat in int v_at;

bool precedes(uint at, float front, uint light)
{
    float other = elements[at].front;
    return other < front || (other == front && elements[at].light < light);
}

void main()
{
    if (gl_HelperInvocation)
        return;
    light_linked_list_light light = light_linked_list_fetch(v_at);
    vec2 span;
    if (!light_linked_list_interval(light, light_linked_list_tile_beam(gl_FragCoord.xy), span))
        return;
    uint list = light_linked_list_list(), index = uint(light.index);
    uint at = light_linked_list_allocate(span.x, span.y, index);
    bool is_done = at == LIGHT_LINKED_LIST_END;
    uint previous = LIGHT_LINKED_LIST_END, next = is_done ? LIGHT_LINKED_LIST_END : heads[list];
    for (int i = 0; i < LIGHT_LINKED_LIST_STEPS && !is_done; i++) {
        if (next != LIGHT_LINKED_LIST_END && precedes(next, span.x, index)) {
            previous = next;
            next = elements[next].next;
            continue;
        }
        elements[at].next = next;
        memoryBarrierBuffer();
        uint found = previous == LIGHT_LINKED_LIST_END ? atomicCompSwap(heads[list], next, at)
                                         : atomicCompSwap(elements[previous].next, next, at);
        is_done = found == next;
        next = found; // lost the race: go on from whatever came in between
    }
    if (!is_done)
        atomicAdd(failure_count, 1u);
}

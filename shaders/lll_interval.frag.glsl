// SPDX-License-Identifier: MIT
// Corrected light linked lists: an analytic, conservative depth interval per tile, inserted without
// a lock, sorted by (front, light), so that lists do not depend on the order of arrival.
// Insertion: Harris 2001, "A pragmatic implementation of non-blocking linked-lists", without
// deletion.
#include "lll_light.glsl"
#include "lll_elements.glsl"
#include "lll_interval.glsl"

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
    lll_light light = lll_fetch(v_at);
    vec2 span;
    if (!lll_interval(light, lll_tile_beam(gl_FragCoord.xy), span))
        return;
    uint list = lll_list(), index = uint(light.index);
    uint at = lll_allocate(span.x, span.y, index);
    bool is_done = at == LLL_END;
    uint previous = LLL_END, next = is_done ? LLL_END : heads[list];
    for (int i = 0; i < LLL_STEPS && !is_done; i++) {
        if (next != LLL_END && precedes(next, span.x, index)) {
            previous = next;
            next = elements[next].next;
            continue;
        }
        elements[at].next = next;
        memoryBarrierBuffer();
        uint found = previous == LLL_END ? atomicCompSwap(heads[list], next, at)
                                         : atomicCompSwap(elements[previous].next, next, at);
        is_done = found == next;
        next = found; // lost the race: go on from whatever came in between
    }
    if (!is_done)
        atomicAdd(failure_count, 1u);
}

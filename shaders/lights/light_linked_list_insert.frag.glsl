// SPDX-License-Identifier: MIT
// Second pass of a light linked list: back faces insert their light, sorted by front depth, under
// the list's spin lock (Lindbeck 2015, 1.2.2, 2.1.1, 2.2.2). The lock is held inside the loop that
// takes it: the published form, spin first and insert after, hangs where lanes run in step.
#include "shared/layout.h"
#include "shared/records.h"
#include "lights/light_linked_list_elements.glsl"
#include "base/spin.glsl"

layout(binding = UNIT_LIGHT_FRONT) uniform sampler2D u_front;
uniform float u_inside_front; // front of a light that holds the eye: 0; orthographic: -FLT_MAX

in float v_view_z;
flat in uint v_light;

// The new head of the list.
uint insert_sorted(uint head, uint at, float front)
{
    uint previous = LIGHT_LINKED_LIST_END, next = head;
    for (int i = 0; i < LIGHT_LINKED_LIST_STEPS && next != LIGHT_LINKED_LIST_END &&
                    elements[next].front <= front; i++) {
        previous = next;
        next = elements[next].next;
    }
    elements[at].next = next;
    if (previous == LIGHT_LINKED_LIST_END)
        return at;
    elements[previous].next = at;
    return head;
}

void main()
{
    if (gl_HelperInvocation)
        return;
    float back = v_view_z;
    float front = texelFetch(u_front, ivec2(gl_FragCoord.xy), 0).x;
    if (front > back)
        front = u_inside_front;
    uint list = light_linked_list_list();
    uint at = light_linked_list_allocate(front, back, v_light);
    bool is_done = at == LIGHT_LINKED_LIST_END;
    spin s = spin(0u, 0u);
    while (!is_done && s.tries < LOCK_TRIES) {
        if (spin_pauses(s) || heads[list] == LIGHT_LINKED_LIST_LOCKED)
            continue;
        uint head = atomicExchange(heads[list], LIGHT_LINKED_LIST_LOCKED);
        if (head != LIGHT_LINKED_LIST_LOCKED) {
            head = insert_sorted(head, at, front);
            memoryBarrierBuffer();
            atomicExchange(heads[list], head);
            is_done = true;
        }
    }
    if (!is_done)
        atomicAdd(failure_count, 1u);
}

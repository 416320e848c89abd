// SPDX-License-Identifier: MIT
// Sorts the events of one texel per thread in registers: NET is 2, 4, 8, 16 or 32. With RUNS longer
// lists become sorted runs of 32 in scratch memory, for shadow_merge.comp.glsl.
// KEYED: depth and index alone are sorted (shadow_sort_keyed.glsl).
#ifdef RUNS
#define SCRATCH
#endif
#include "shadows/shadow_list.glsl"
#include "shadows/shadow_network.glsl"

layout(binding = UNIT_SHADOW_EVENTS) uniform samplerBuffer u_events; // the same memory, for reading
#ifdef IDS
layout(binding = UNIT_SHADOW_ID) uniform usamplerBuffer u_id;
#endif
#ifdef MEDIA
layout(binding = UNIT_SHADOW_MEDIA) uniform usamplerBuffer u_media;
#endif

#define FAR_AWAY 3.0e38 // pads the list; no event is as deep

#ifdef KEYED
#include "shadows/shadow_sort_keyed.glsl"
#else
#define DEPTH(i) e[i].z_t.x
#define EVENT(i) e[i]
event e[NET];

void load(int i, uint place, bool is_used)
{
    place += u_event_window;
    e[i].z_t = is_used ? texelFetch(u_events, int(place)) : vec4(FAR_AWAY, vec3(1.0));
#ifdef IDS
    e[i].id = is_used ? texelFetch(u_id, int(place)).r : 0u;
#endif
#ifdef MEDIA
    e[i].medium = is_used ? texelFetch(u_media, int(place)).r : 0u;
#endif
}

void exchange(int i, int j, bool is_wrong)
{
    event a = e[i], b = e[j];
    e[i].z_t = mix(a.z_t, b.z_t, bvec4(is_wrong));
    e[j].z_t = mix(b.z_t, a.z_t, bvec4(is_wrong));
#ifdef IDS
    e[i].id = is_wrong ? b.id : a.id;
    e[j].id = is_wrong ? a.id : b.id;
#endif
#ifdef MEDIA
    e[i].medium = is_wrong ? b.medium : a.medium;
    e[j].medium = is_wrong ? a.medium : b.medium;
#endif
}
#endif

#define CE(i, j) exchange(i, j, DEPTH(i) > DEPTH(j));
#define LOAD(i) load(i, first + uint(i), uint(i) < n);
#define TIE(i) tie = tie || (uint((i) + 1) < n && DEPTH(i) == DEPTH((i) + 1));
#define TIE_CE(i) swap = event_is_after(e[i], e[(i) + 1]); \
    swapped = swapped || swap; exchange(i, (i) + 1, swap);
#define APPEND(i) if (uint(i) < n) list_append(end, first, n, uint(i), EVENT(i));
#define STORE(i) if (uint(i) < n) scratch_write(at + uint(i), EVENT(i));

#if NET == 2
#define NETWORK CE(0, 1)
#define ALL(DO) DO(0) DO(1)
#define PAIRS(DO) DO(0)
#elif NET == 4
#define NETWORK CE(0, 1) CE(2, 3) CE(0, 2) CE(1, 3) CE(1, 2)
#define ALL(DO) DO(0) DO(1) DO(2) DO(3)
#define PAIRS(DO) DO(0) DO(1) DO(2)
#elif NET == 8
#define NETWORK NETWORK_8
#define ALL(DO) EACH_8(DO, 0)
#define PAIRS(DO) EACH_7(DO, 0)
#elif NET == 16
#define NETWORK NETWORK_16
#define ALL(DO) EACH_8(DO, 0) EACH_8(DO, 8)
#define PAIRS(DO) EACH_8(DO, 0) EACH_7(DO, 8)
#else
#define NETWORK NETWORK_32
#define ALL(DO) EACH_8(DO, 0) EACH_8(DO, 8) EACH_8(DO, 16) EACH_8(DO, 24)
#define PAIRS(DO) EACH_8(DO, 0) EACH_8(DO, 8) EACH_8(DO, 16) EACH_7(DO, 24)
#endif

// The network knows z only. Coplanar events, which are rare, are put in their order by exchanges of
// neighbours.
void sort_registers(uint first, uint n)
{
    ALL(LOAD)
    NETWORK
    bool tie = false;
    PAIRS(TIE)
#ifdef KEYED
    ALL(NOTE_ORDER)
    order_ties(first, n, tie);
#else
    for (bool swapped = tie; swapped;) {
        bool swap;
        swapped = false;
        PAIRS(TIE_CE)
    }
#endif
}

#ifdef KEYED
#define EACH_EVENT(DO) for (uint i = 0u; i < n; i++) { DO(i) }
#else
#define EACH_EVENT(DO) ALL(DO)
#endif

#ifdef RUNS
void store_run(uint first, uint at, uint n)
{
    sort_registers(first, n);
    EACH_EVENT(STORE)
}

void sort_list(uint first, uint n)
{
    for (uint at = 0u; at < n; at += uint(NET))
        store_run(first + at, at, min(uint(NET), n - at));
}
#else
void sort_list(uint first, uint n)
{
    sort_registers(first, n);
    list_end end = list_end_begin();
    EACH_EVENT(APPEND)
}
#endif

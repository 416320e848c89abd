// SPDX-License-Identifier: MIT
// One level of merging the sorted runs of long lists, one list per thread: from the streams to
// scratch memory, or (FROM_SCRATCH) back; LAST finishes the list. A thread loops once per event and
// pair of runs, so lists are limited to 60,000 events by llvmpipe's 65,535 loop iterations (the
// host checks).
#include "shadow_list.glsl"

layout(binding = UNIT_SHADOW_EVENTS) uniform samplerBuffer u_events; // the same memory, for reading
#ifdef IDS
layout(binding = UNIT_SHADOW_ID) uniform usamplerBuffer u_id;
#endif
#ifdef MEDIA
layout(binding = UNIT_SHADOW_MEDIA) uniform usamplerBuffer u_media;
#endif

uniform uint u_width; // of a run

#ifdef FROM_SCRATCH
event read_source(uint place)
{
    return scratch_read(place - u_event_base);
}
#else
event read_source(uint place)
{
    event e;
    e.z_t = texelFetch(u_events, int(place));
#ifdef IDS
    e.id = texelFetch(u_id, int(place)).r;
#endif
#ifdef MEDIA
    e.medium = texelFetch(u_media, int(place)).r;
#endif
    return e;
}
#endif

event choose(bool is_first, event a, event b)
{
    event e;
    e.z_t = mix(b.z_t, a.z_t, bvec4(is_first));
#ifdef IDS
    e.id = is_first ? a.id : b.id;
#endif
#ifdef MEDIA
    e.medium = is_first ? a.medium : b.medium;
#endif
    return e;
}

void write_result(inout list_end end, uint first, uint n, uint i, event e)
{
#if defined(LAST)
    list_append(end, first, n, i, e);
#elif defined(FROM_SCRATCH)
    stream_write(first + i, e);
#else
    scratch_write(first + i - u_event_base, e);
#endif
}

void sort_list(uint begin, uint finish)
{
    uint base = u_event_base + begin, n = finish - begin;
    list_end end = list_end_begin();
    for (uint pair = 0u; pair < n; pair += 2u * u_width) {
        uint a = pair, a_end = min(pair + u_width, n);
        uint b = a_end, b_end = min(pair + 2u * u_width, n);
        event e_a = read_source(base + a), e_b = read_source(base + min(b, n - 1u));
        for (uint i = pair; i < b_end; i++) {
            bool takes_a = a < a_end && (b >= b_end || !event_is_after(e_a, e_b));
            write_result(end, base, n, i, choose(takes_a, e_a, e_b));
            a += takes_a ? 1u : 0u;
            b += takes_a ? 0u : 1u;
            event e = read_source(base + min(takes_a ? a : b, n - 1u));
            e_a = choose(takes_a, e, e_a);
            e_b = choose(takes_a, e_b, e);
        }
    }
}

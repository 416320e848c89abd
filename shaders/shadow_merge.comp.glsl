// SPDX-License-Identifier: MIT
// One level of merging the sorted runs of long lists, one list per thread; the last level finishes the list. A thread
// loops once per event, so lists are limited to 60,000 events by llvmpipe's 65,535 loop iterations (host: checked).
#include "shadow_list.glsl"

uniform uint u_level; // runs are of 32 << u_level events

bool from_scratch;

event read_source(uint place)
{
    if (from_scratch)
        return scratch_read(place - u_event_base);
    event e;
    e.z_t = vec4(events_z[place], events_t[3u * place], events_t[3u * place + 1u], events_t[3u * place + 2u]);
#ifdef IDS
    e.id = events_id[place];
#endif
    return e;
}

void sort_list(uint begin, uint finish)
{
    uint levels = list_levels(finish - begin);
    if (u_level >= levels)
        return;
    from_scratch = ((levels - u_level) & 1u) != 0u;
    bool is_last = u_level + 1u == levels;
    uint width = 32u << u_level;
    uint base = u_event_base + begin, n = finish - begin;
    uint a = 0u, a_end = min(width, n), b = a_end, b_end = min(2u * width, n);
    list_end end = list_end_begin();
    event e_a = read_source(base + a), e_b = read_source(base + min(b, n - 1u));
    for (uint i = 0u; i < n; i++) {
        bool takes_a = a < a_end && (b >= b_end || !event_is_after(e_a, e_b));
        event e = e_a;
        if (!takes_a)
            e = e_b;
        if (is_last)
            list_append(end, base + i, e);
        else if (from_scratch)
            stream_write(base + i, e);
        else
            scratch_write(base + i - u_event_base, e);
        a += takes_a ? 1u : 0u;
        b += takes_a ? 0u : 1u;
        if (a >= a_end && b >= b_end) { // the next pair of runs
            a = b_end;
            a_end = min(a + width, n);
            b = a_end;
            b_end = min(b + width, n);
            e_a = read_source(base + min(a, n - 1u));
            e_b = read_source(base + min(b, n - 1u));
        } else if (takes_a) {
            e_a = read_source(base + min(a, n - 1u));
        } else {
            e_b = read_source(base + min(b, n - 1u));
        }
    }
}

// SPDX-License-Identifier: MIT
// One level of merging the sorted runs of long lists, one list per thread, from one half of scratch
// memory to the other; LAST finishes the list in the streams. A thread loops once per event and
// pair of runs, so lists are limited to 60,000 events by llvmpipe's 65,535 loop iterations (the
// host checks).
#include "shadows/shadow_list.glsl"

uniform uint u_width; // of a run

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
#ifdef LAST
    list_append(end, first, n, i, e);
#else
    scratch_write(i, e);
#endif
}

void sort_list(uint first, uint n)
{
    list_end end = list_end_begin();
    for (uint pair = 0u; pair < n; pair += 2u * u_width) {
        uint a = pair, a_end = min(pair + u_width, n);
        uint b = a_end, b_end = min(pair + 2u * u_width, n);
        event e_a = scratch_read(a), e_b = scratch_read(min(b, n - 1u));
        for (uint i = pair; i < b_end; i++) {
            bool takes_a = a < a_end && (b >= b_end || !event_is_after(e_a, e_b));
            write_result(end, first, n, i, choose(takes_a, e_a, e_b));
            a += takes_a ? 1u : 0u;
            b += takes_a ? 0u : 1u;
            event e = scratch_read(min(takes_a ? a : b, n - 1u));
            e_a = choose(takes_a, e, e_a);
            e_b = choose(takes_a, e_b, e);
        }
    }
}

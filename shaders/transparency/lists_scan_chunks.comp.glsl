// SPDX-License-Identifier: MIT
// The same words as lists_scan.comp.glsl, without shared memory: on a device that is our own cores
// a barrier between the threads of a group costs more than the few threads at work here.
//   PASS=0  a thread per chunk: sum and maximum of its counts
//   PASS=1  one thread: exclusive scan of the sums; total and longest to the statistics
//   PASS=2  a thread per chunk: inclusive scan of its counts
#include "transparency/lists_counts.glsl"
layout(local_size_x = 64) in;
uniform uint u_chunk;  // counts per chunk; host keeps chunk and chunk count under 16,384
uniform uint u_chunks;

void main()
{
    uint thread = gl_GlobalInvocationID.x;
#if PASS == 1
    if (thread != 0u)
        return;
    uint running = 0u, longest = 0u;
    for (uint i = 0u; i < u_chunks; i++) {
        uvec2 chunk = sums[i];
        sums[i].x = running;
        running = add_saturated(running, chunk.x);
        longest = max(longest, chunk.y);
    }
    statistics[0] = running;
    statistics[1] = longest;
#else
    if (thread >= u_chunks)
        return;
    uint first = thread * u_chunk, end = min(first + u_chunk, u_count);
#if PASS == 0
    uint sum = 0u, longest = 0u;
    for (uint i = first; i < end; i++) {
        sum = add_saturated(sum, counts[i]);
        longest = max(longest, counts[i]);
    }
    sums[thread] = uvec2(sum, longest);
#else
    uint running = sums[thread].x;
    for (uint i = first; i < end; i++) {
        running = add_saturated(running, counts[i]);
        ends[i] = running;
    }
#endif
#endif
}

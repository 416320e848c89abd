// SPDX-License-Identifier: MIT
// Exclusive scan of the counts of one light in place, and the lists of its texels by length class, in three dispatches
// without shared memory: the result depends on the counts alone, never on the order of threads.
//   PASS=0  one thread per chunk: sums of the chunk
//   PASS=1  one thread: exclusive scan of the chunk sums; totals to the statistics
//   PASS=2  one thread per chunk: exclusive scan of its counts, and its texels of two or more events by class
// A thread loops over u_chunk or u_chunks entries; the host keeps both below 17,000.
#include "shared/bindings.h"

layout(local_size_x = 64) in;
layout(std430, binding = BIND_SHADOW_COUNTS) buffer count_buffer { uint counts[]; };
layout(std430, binding = BIND_SCAN) buffer scan_buffer { uint sums[]; };
layout(std430, binding = BIND_STATISTICS) writeonly buffer statistics_buffer { uint statistics[]; };
layout(std430, binding = BIND_LIST_NODES) writeonly buffer list_buffer { uint class_texels[]; };

uniform uint u_first;   // of the light's counts
uniform uint u_count;
uniform uint u_chunk;   // entries per chunk
uniform uint u_chunks;
uniform uint u_chunk_first; // of the light in sums
uniform uint u_slot;    // of the light in the statistics
uniform uint u_list;    // of the light in class_texels

// Words of a chunk and of a slot. CLASSES classes: 2, 3..4, 5..8, 9..16, 17..32 and more events in a texel.
#define WORDS 12u
#define SUM 0u
#define HIGH 1u       // bits 32.. of the total
#define LONGEST 2u
#define OCCUPIED 3u
#define CLASS_0 4u
#define CLASSES 6u

uint length_class(uint n)
{
    return min(uint(findMSB(n - 1u)), CLASSES - 1u);
}

#if PASS == 0
void scan(uint thread)
{
    uint first = u_first + thread * u_chunk;
    uint end = min(first + u_chunk, u_first + u_count);
    uint sum = 0u, longest = 0u, occupied = 0u;
    uvec3 low = uvec3(0u), high = uvec3(0u);
    for (uint i = first; i < end; i++) {
        uint n = counts[i];
        sum += n;
        longest = max(longest, n);
        occupied += min(n, 1u);
        uint c = n < 2u ? CLASSES : length_class(n);
        low += uvec3(equal(uvec3(c), uvec3(0u, 1u, 2u)));
        high += uvec3(equal(uvec3(c), uvec3(3u, 4u, 5u)));
    }
    uint at = (u_chunk_first + thread) * WORDS;
    sums[at + SUM] = sum;
    sums[at + LONGEST] = longest;
    sums[at + OCCUPIED] = occupied;
    for (uint c = 0u; c < 3u; c++) {
        sums[at + CLASS_0 + c] = low[c];
        sums[at + CLASS_0 + 3u + c] = high[c];
    }
}
#elif PASS == 1
// The lists of a light lie one after another, so a chunk's part of class c starts after all of the classes below.
void scan(uint thread)
{
    uint running[WORDS];
    for (uint w = 0u; w < WORDS; w++)
        running[w] = 0u;
    for (uint i = 0u; i < u_chunks; i++) {
        uint at = (u_chunk_first + i) * WORDS, carry, sum = sums[at + SUM];
        sums[at + SUM] = running[SUM];
        running[SUM] = uaddCarry(running[SUM], sum, carry);
        running[HIGH] += carry;
        running[LONGEST] = max(running[LONGEST], sums[at + LONGEST]);
        running[OCCUPIED] += sums[at + OCCUPIED];
        for (uint c = CLASS_0; c < CLASS_0 + CLASSES; c++) {
            uint n = sums[at + c];
            sums[at + c] = running[c];
            running[c] += n;
        }
    }
    for (uint w = 0u; w < WORDS; w++)
        statistics[u_slot * WORDS + w] = running[w];
}
#else
uniform uint u_class_first[CLASSES]; // in the light's list

void scan(uint thread)
{
    uint first = u_first + thread * u_chunk;
    uint end = min(first + u_chunk, u_first + u_count);
    uint at = (u_chunk_first + thread) * WORDS;
    uint running = sums[at + SUM];
    uint place[CLASSES];
    for (uint c = 0u; c < CLASSES; c++)
        place[c] = u_list + u_class_first[c] + sums[at + CLASS_0 + c];
    for (uint i = first; i < end; i++) {
        uint n = counts[i];
        counts[i] = running;
        running += n;
        if (n > 1u)
            class_texels[place[length_class(n)]++] = i - u_first;
    }
}
#endif

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint thread = group * 64u + gl_LocalInvocationID.x;
#if PASS == 1
    if (thread == 0u)
#else
    if (thread < u_chunks)
#endif
        scan(thread);
}

// SPDX-License-Identifier: MIT
// Exclusive scan of the counts of one light in place, and the lists of its texels by length class,
// in three dispatches without shared memory: the result depends on the counts alone, never on the
// order of threads.
//   PASS=0  one thread per chunk: sums of the chunk
//   PASS=1  one thread per word: exclusive scan of the chunk sums; totals to the statistics
//   PASS=2  one thread per chunk: exclusive scan of its counts, and its texels of u_shortest or
//           more events by class
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
uniform uint u_shortest; // list to be finished: 2; with media 1

// Words of a chunk and of a slot. Class c: texels of 2^c + 1 to 2^(c + 1) events; class 0: of
// u_shortest to 2.
#define WORDS 20u
#define SUM 0u
#define HIGH 1u       // bits 32.. of the total
#define LONGEST 2u
#define OCCUPIED 3u
#define CLASS_0 4u
#define CLASSES 16u

uint length_class(uint n)
{
    return min(uint(findMSB(max(n, 2u) - 1u)), CLASSES - 1u);
}

#if PASS == 0
void scan(uint thread)
{
    uint first = u_first + thread * u_chunk;
    uint end = min(first + u_chunk, u_first + u_count);
    uint sum = 0u, longest = 0u, occupied = 0u;
    uvec4 classes[CLASSES / 4u];
    for (uint c = 0u; c < CLASSES / 4u; c++)
        classes[c] = uvec4(0u);
    for (uint i = first; i < end; i++) {
        uint n = counts[i];
        sum += n;
        longest = max(longest, n);
        occupied += min(n, 1u);
        uint class_ = n < u_shortest ? CLASSES : length_class(n);
        uvec4 c = uvec4(class_) - uvec4(0u, 1u, 2u, 3u); // selects: no indexed memory
        classes[0] += uvec4(equal(c, uvec4(0u)));
        classes[1] += uvec4(equal(c, uvec4(4u)));
        classes[2] += uvec4(equal(c, uvec4(8u)));
        classes[3] += uvec4(equal(c, uvec4(12u)));
    }
    uint at = (u_chunk_first + thread) * WORDS;
    sums[at + SUM] = sum;
    sums[at + LONGEST] = longest;
    sums[at + OCCUPIED] = occupied;
    for (uint c = 0u; c < CLASSES; c++)
        sums[at + CLASS_0 + c] = classes[c / 4u][c % 4u];
}
#elif PASS == 1
// One thread per word.
void scan(uint word)
{
    uint running = 0u, high = 0u;
    for (uint i = 0u; i < u_chunks; i++) {
        uint at = (u_chunk_first + i) * WORDS + word, carry, n = sums[at];
        sums[at] = running;
        if (word == LONGEST)
            running = max(running, n);
        else
            running = uaddCarry(running, n, carry), high += carry;
    }
    if (word == HIGH)
        return;
    statistics[u_slot * WORDS + word] = running;
    if (word == SUM)
        statistics[u_slot * WORDS + HIGH] = high;
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
        if (n >= u_shortest)
            class_texels[place[length_class(n)]++] = i - u_first;
    }
}
#endif

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint thread = group * 64u + gl_LocalInvocationID.x;
#if PASS == 1
    if (thread < WORDS)
#else
    if (thread < u_chunks)
#endif
        scan(thread);
}

// SPDX-License-Identifier: MIT
// From the per-pixel counts to the ends of their lists, in three levels as shadow_scan.comp.glsl.
//   PASS=0  a group per tile of TILE counts: their sum and maximum
//   PASS=1  one group: exclusive scan of the sums; total and longest to the statistics
//   PASS=2  a group per tile: inclusive scan of its counts
// Saturated sums are associative. A thread loops over 8 counts, or over the tiles divided by 256.
#include "transparency/lists_counts.glsl"

#define ITEMS 8u
#define TILE (256u * ITEMS)

#define SCAN_SUM 0u
#define SCAN_LONGEST 1u
#if PASS == 2
#define SCAN_WORDS 1u
#define SCAN_JOIN(word, a, b) add_saturated(a, b)
#else
#define SCAN_WORDS 2u
#define SCAN_JOIN(word, a, b) ((word) == SCAN_LONGEST ? max(a, b) : add_saturated(a, b))
#endif

layout(local_size_x = 256) in;
#include "base/group_scan.glsl"

uniform uint u_tiles;

#if PASS == 0
void main()
{
    uint tile = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (tile >= u_tiles)
        return;
    uint sum = 0u, longest = 0u;
    for (uint k = 0u; k < ITEMS; k++) {
        uint i = tile * TILE + k * SCAN_THREADS + gl_LocalInvocationIndex;
        uint n = i < u_count ? counts[i] : 0u;
        sum = add_saturated(sum, n);
        longest = max(longest, n);
    }
    scan_put(SCAN_SUM, sum);
    scan_put(SCAN_LONGEST, longest);
    scan_group();
    if (gl_LocalInvocationIndex == 0u)
        sums[tile] = uvec2(scan_total(SCAN_SUM), scan_total(SCAN_LONGEST));
}
#elif PASS == 1
void main()
{
    uint share = (u_tiles + SCAN_THREADS - 1u) / SCAN_THREADS;
    uint first = min(gl_LocalInvocationIndex * share, u_tiles), end = min(first + share, u_tiles);
    uint sum = 0u, longest = 0u;
    for (uint i = first; i < end; i++) {
        sum = add_saturated(sum, sums[i].x);
        longest = max(longest, sums[i].y);
    }
    scan_put(SCAN_SUM, sum);
    scan_put(SCAN_LONGEST, longest);
    scan_group();
    uint running = scan_before(SCAN_SUM);
    for (uint i = first; i < end; i++) {
        uint n = sums[i].x;
        sums[i].x = running;
        running = add_saturated(running, n);
    }
    if (gl_LocalInvocationIndex == 0u) {
        statistics[0] = scan_total(SCAN_SUM);
        statistics[1] = scan_total(SCAN_LONGEST);
    }
}
#else
shared uint tile_counts[TILE + TILE / 32u]; // padded: threads eight apart read other banks

uint tile_place(uint i)
{
    return i + i / 32u;
}

void main()
{
    uint tile = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint thread = gl_LocalInvocationIndex;
    if (tile >= u_tiles)
        return;
    for (uint k = 0u; k < ITEMS; k++) {
        uint i = k * SCAN_THREADS + thread;
        tile_counts[tile_place(i)] = tile * TILE + i < u_count ? counts[tile * TILE + i] : 0u;
    }
    scan_wait();
    uint sum = 0u;
    for (uint k = 0u; k < ITEMS; k++)
        sum = add_saturated(sum, tile_counts[tile_place(thread * ITEMS + k)]);
    scan_put(SCAN_SUM, sum);
    scan_group();
    uint running = add_saturated(sums[tile].x, scan_before(SCAN_SUM));
    for (uint k = 0u; k < ITEMS; k++) {
        uint n = tile_counts[tile_place(thread * ITEMS + k)];
        running = add_saturated(running, n);
        tile_counts[tile_place(thread * ITEMS + k)] = running;
    }
    scan_wait();
    for (uint k = 0u; k < ITEMS; k++) {
        uint i = k * SCAN_THREADS + thread;
        if (tile * TILE + i < u_count)
            ends[tile * TILE + i] = tile_counts[tile_place(i)];
    }
}
#endif

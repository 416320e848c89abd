// SPDX-License-Identifier: MIT
// From the counts of the cells to their first pairs, by one group of threads, and their sum in 64
// bits: the counts' lower and upper halves are summed apart.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#define SCAN_WORDS 3u
#define SCAN_JOIN(word, a, b) ((word) == 2u ? max(a, b) : (a) + (b))
layout(local_size_x = 256) in;
#include "base/group_scan.glsl"

layout(std430, binding = BIND_AREA_COUNTS) readonly buffer count_buffer { uint counts[]; };
layout(std430, binding = BIND_AREA_FIRSTS) writeonly buffer first_buffer { uint firsts[]; };
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { area_statistics statistics; };
uniform uint u_count; // cells: a multiple of 256

void main()
{
    uint each = u_count / 256u, begin = gl_LocalInvocationIndex * each;
    uint low = 0u, high = 0u, longest = 0u;
    for (uint i = 0u; i < each; i++) {
        uint count = counts[begin + i];
        low += count & 0xffffu;
        high += count >> 16;
        longest = max(longest, count);
    }
    scan_put(0u, low);
    scan_put(1u, high);
    scan_put(2u, longest);
    scan_group();
    uint running = scan_before(0u) + (scan_before(1u) << 16); // modulo 2^32, as differences are
    for (uint i = 0u; i < each; i++) {
        firsts[begin + i] = running;
        running += counts[begin + i];
    }
    if (gl_LocalInvocationIndex == 255u)
        firsts[u_count] = running;
    if (gl_LocalInvocationIndex == 0u) {
        uint lows = scan_total(0u), highs = scan_total(1u);
        statistics.pairs[0] = lows + (highs << 16);
        statistics.pairs[1] = (highs + (lows >> 16)) >> 16;
        statistics.longest = scan_total(2u);
    }
}

// SPDX-License-Identifier: MIT
// Sorts the per-pixel lists, nearest first, by (depth, triangle): a total order, so the result does
// not depend on how the fragments arrived. A thread per entry.
//   PASS=0  runs of RUN entries by insertion, by the first thread of each, in the buffer:
//           llvmpipe 22.3 loses copies between elements of a local array
//   PASS=1  merges two sorted runs of u_run entries from u_from to u_to halves of the buffer: each
//           thread finds the rank of its entry in the other run (Satish, Harris and Garland 2009,
//           "Designing efficient sorting algorithms for manycore GPUs")
//   PASS=2  the same by the first thread of two runs, for long runs on a device that is our own
//           cores: halving a run costs as many reads as its logarithm, which no lane there hides
// The longest loop is 2 * u_run < 65,536: the host refuses longer lists.
#include "shared/bindings.h"
#define RUN 16u
layout(local_size_x = 64) in;
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
layout(std430, binding = BIND_ENTRY_KEYS) coherent buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_2) readonly buffer s2_buffer { uvec4 surfaces_2[]; };
uniform uint u_entries; // that there is room for
uniform uint u_pixels;
uniform uint u_run;
uniform uint u_from; // offset of the half that is read; its keys are u_entries long
uniform uint u_to;

// Reversed depth: greater is nearer, and bits of non-negative floats order like the floats.
bool comes_before(uvec4 a, uvec4 b)
{
    if (a.x != b.x)
        return a.x > b.x;
    return a.y != b.y ? a.y < b.y : a.w < b.w;
}

void main()
{
    uint entry = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationID.x;
    if (entry >= min(u_entries, ends[u_pixels - 1u]))
        return;
    uint pixel = surfaces_2[keys[u_from + entry].z].z;
    uint first = pixel == 0u ? 0u : ends[pixel - 1u], end = min(ends[pixel], u_entries);
#if PASS == 0
    if ((entry - first) % RUN != 0u)
        return;
    uint n = min(RUN, end - entry);
    if (n < 2u)
        return;
    for (uint i = 1u; i < n; i++) {
        uvec4 key = keys[entry + i];
        uint at = i;
        while (at > 0u) {
            uvec4 before = keys[entry + at - 1u];
            if (!comes_before(key, before))
                break;
            keys[entry + at] = before;
            at--;
        }
        keys[entry + at] = key;
    }
#elif PASS == 1
    // Its place is its own in its run, and as many behind as entries of the other run come before
    // it: of equal ones, those of the first run.
    uint run = entry - (entry - first) % u_run, pair = entry - (entry - first) % (2u * u_run);
    bool is_second = run != pair;
    uint low = is_second ? pair : min(pair + u_run, end);
    uint high = is_second ? run : min(pair + 2u * u_run, end), other = low;
    uvec4 key = keys[u_from + entry];
    while (low < high) {
        uint middle = (low + high) / 2u, depth = keys[u_from + middle].x;
        bool is_behind = depth > key.x; // the key is; ties are rare
        if (depth == key.x) {
            uvec4 there = keys[u_from + middle];
            is_behind = is_second ? !comes_before(key, there) : comes_before(there, key);
        }
        if (is_behind)
            low = middle + 1u;
        else
            high = middle;
    }
    keys[u_to + pair + (entry - run) + (low - other)] = key;
#else
    if ((entry - first) % (2u * u_run) != 0u)
        return;
    uint middle = min(entry + u_run, end), last = min(entry + 2u * u_run, end);
    uint a = entry, b = middle;
    for (uint i = entry; i < last; i++) {
        bool take_a = b >= last;
        if (!take_a && a < middle)
            take_a = !comes_before(keys[u_from + b], keys[u_from + a]);
        keys[u_to + i] = keys[u_from + (take_a ? a++ : b++)];
    }
#endif
}

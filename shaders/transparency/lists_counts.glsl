// SPDX-License-Identifier: MIT
// What both scans of the per-pixel counts read and write: lists_scan.comp.glsl and
// lists_scan_chunks.comp.glsl.
// Sums saturate, so that an absurd total is seen as too large and not as small.
#include "shared/bindings.h"

layout(std430, binding = BIND_PIXEL_LEFT) readonly buffer count_buffer { uint counts[]; };
#if PASS == 2
layout(std430, binding = BIND_PIXEL_COUNTS) writeonly buffer end_buffer { uint ends[]; };
#endif
layout(std430, binding = BIND_SCAN) buffer scan_buffer { uvec2 sums[]; };
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };
uniform uint u_count;

uint add_saturated(uint a, uint b)
{
    return a + b < a ? 0xffffffffu : a + b;
}

// SPDX-License-Identifier: MIT
// First pass of the per-pixel lists: counts the transparent fragments in front of the opaque depth.
#include "shared/bindings.h"
layout(early_fragment_tests) in;
layout(std430, binding = BIND_PIXEL_LEFT) buffer count_buffer { uint counts[]; };
uniform uint u_width_px;

void main()
{
    atomicAdd(counts[uint(gl_FragCoord.y) * u_width_px + uint(gl_FragCoord.x)], 1u);
}

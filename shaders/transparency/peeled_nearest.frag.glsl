// SPDX-License-Identifier: MIT
// First pass of peeling a layer: the depth of the nearest fragment behind the last layer. Everitt
// 2001, "Interactive Order-Independent Transparency", with a maximum by atomics in place of a
// second depth buffer, so that it compares whole keys. DUAL: and of the farthest before the last
// one from behind, after Bavoil and Myers 2008, "Order Independent Transparency with Dual Depth
// Peeling".
#include "shared/bindings.h"
#define PEELED_ACCESS coherent
#define PEELS_FRAGMENTS
#include "transparency/peeled_state.glsl"
layout(early_fragment_tests) in;
layout(location = 2) flat in uvec4 v_ids;
#include "transparency/tie_key.glsl"
uniform uint u_width_px;

void main()
{
    uint pixel = uint(gl_FragCoord.y) * u_width_px + uint(gl_FragCoord.x);
    uint depth = floatBitsToUint(clamp(gl_FragCoord.z, 0.0, 1.0));
    if (!is_left(pixel, depth, peeled_tie(tie_key())))
        return;
    atomicMax(NEAREST_DEPTH(pixel), depth);
#ifdef DUAL
    atomicMin(FARTHEST_DEPTH(pixel), depth);
#endif
}

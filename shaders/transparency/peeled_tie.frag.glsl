// SPDX-License-Identifier: MIT
// Second pass of peeling a layer: of the fragments at the depth that the first has found, the one
// that comes first; DUAL: of those at the farthest depth the one that comes last. So coplanar
// layers are peeled one after the other, and none is lost.
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
    uint depth = floatBitsToUint(clamp(gl_FragCoord.z, 0.0, 1.0)), tie = peeled_tie(tie_key());
    if (!is_left(pixel, depth, tie))
        return;
    if (depth == NEAREST_DEPTH(pixel))
        atomicMin(NEAREST_TIE(pixel), tie);
#ifdef DUAL
    if (depth == FARTHEST_DEPTH(pixel))
        atomicMax(FARTHEST_TIE(pixel), tie);
#endif
}

// SPDX-License-Identifier: MIT
// Counts itself and notes its coverage: do all side effects of fragments survive, and are masks
// true?
#include "probes/selftest.glsl"

layout(early_fragment_tests) in;
#ifdef POST_DEPTH_COVERAGE
layout(post_depth_coverage) in;
#endif

uniform uint u_id;
layout(location = 0) out uint o_id;

void main()
{
    o_id = u_id;
    if (gl_HelperInvocation)
        return;
    atomicAdd(fragments, 1u);
    masks[uint(gl_FragCoord.y) * u_width + uint(gl_FragCoord.x)] = uint(gl_SampleMaskIn[0]);
}

// SPDX-License-Identifier: MIT
// Opaque and masked surfaces into the G-buffer. Needs: those of evaluate.glsl, IS_MASKED.
#include "evaluate.glsl"

layout(location = 0) out uvec4 o_surface_0;
layout(location = 1) out uvec4 o_surface_1;
#ifdef HAS_COVERAGE
layout(location = 2) out uint o_signature;
#endif

void main()
{
    surface s = evaluate_surface();
#ifdef IS_MASKED
    if (s.alpha < materials[s.material].emissive_alpha_cutoff.w)
        discard;
#endif
    s.alpha = 1.0;
    o_surface_0 = surface_pack_0(s);
    o_surface_1 = surface_pack_1(s);
#ifdef HAS_COVERAGE
    o_signature = surface_signature(s);
#endif
}

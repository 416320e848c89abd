// SPDX-License-Identifier: MIT
// Opaque and masked surfaces into the G-buffer. Needs: those of evaluate.glsl, IS_MASKED,
// HAS_NORMAL_OFFSET.
#include "draw/evaluate.glsl"

layout(location = 0) out uvec4 o_surface_0;
layout(location = 1) out uvec4 o_surface_1;
#ifdef HAS_COVERAGE
layout(location = 2) out uint o_signature;
#endif

#ifdef HAS_LOBES
#ifdef HAS_COVERAGE
layout(location = 3)
#else
layout(location = 2)
#endif
    out uvec4 o_lobes; // undefined, and not read, where the material has none
#ifdef HAS_MORE_LOBES
#ifdef HAS_COVERAGE
layout(location = 4)
#else
layout(location = 3)
#endif
    out uvec4 o_more_lobes; // likewise
#endif
#endif

#ifdef HAS_NORMAL_OFFSET
layout(location = 6) in vec2 v_normal_offset;

// How far the vertices' tangent planes lie above the point, on the viewer's side: Hanika 2021,
// "Hacking the Shadow Terminator", Ray Tracing Gems II, chapter 4, but planes below count, too.
// That mean of heights is linear in what is interpolated (Boubekeur and Alexa 2008, "Phong
// Tessellation").
float normal_offset_over_distance(bool is_front)
{
    float above = v_normal_offset.x - dot(v_normal, v_position);
    float scale = v_normal_offset.y * length(v_position);
    return v_normal_offset.y > 0.0 ? (is_front ? above : -above) / scale : 0.0;
}
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
#ifdef HAS_NORMAL_OFFSET
    o_surface_1.y =
        surface_pack_normal_offset(o_surface_1.y, normal_offset_over_distance(s.is_front));
#endif
#ifdef HAS_LOBES
    surface_lobes lobes = evaluate_lobes();
    o_lobes = lobes_pack(lobes);
#ifdef HAS_MORE_LOBES
    o_more_lobes = more_lobes_pack(lobes);
#endif
#endif
#ifdef HAS_COVERAGE
    o_signature = surface_signature(s);
#endif
}

// SPDX-License-Identifier: MIT
// Draws a side face of a shadow volume as many times as it counts, or, IS_CAP, a caster;
// IS_STENCIL: its back where the way loses one there. Needs: those of volume_quads.glsl; IS_CAP,
// IS_STENCIL.
#include "shadows/volume_quads.glsl"
layout(points) in;
layout(triangle_strip, max_vertices = 4u * VOLUME_PATCH_QUADS) out;
in uint v_patch[];
flat out uvec2 v_told;

void main()
{
#ifdef IS_CAP
    drawn_face d = drawn_cap(v_patch[0]);
#else
    drawn_face d = drawn_edge(v_patch[0]);
#endif
    for (uint i = 0u; i < d.count; i++) {
        uvec2 told = told_of(d, d.first + i);
        int turned = 0;
#ifdef IS_STENCIL
        turned = ((told.y & VOLUME_IS_LOST) != 0u) == ((told.y & VOLUME_IS_BEFORE) != 0u) ? 1 : 0;
#endif
        for (int corner = 0; corner < 4; corner++) {
            gl_Position = vec4(d.quad.corners[corner ^ turned], 0.5, 1.0);
            v_told = told;
            EmitVertex();
        }
        EndPrimitive();
    }
}

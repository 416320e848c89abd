// SPDX-License-Identifier: MIT
// Draws a side face of a shadow volume as many times as it counts, or, IS_CAP, a caster, or,
// IS_TRIANGLE, the three sides behind a caster and itself; IS_STENCIL: its back where the way loses
// one there. Needs: those of volume_quads.glsl; IS_CAP, IS_TRIANGLE, IS_STENCIL.
#include "shadows/volume_quads.glsl"
layout(points) in;
#ifdef IS_TRIANGLE
layout(triangle_strip, max_vertices = 16) out;
#else
layout(triangle_strip, max_vertices = 4u * VOLUME_PATCH_QUADS) out;
#endif
in uint v_patch[];
flat out uvec2 v_told;

void emit(drawn_face d)
{
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

void main()
{
#if defined(IS_CAP)
    emit(drawn_cap(v_patch[0]));
#elif defined(IS_TRIANGLE)
    for (uint i = 0u; i < 4u; i++)
        emit(drawn_face_of(v_patch[0], i));
#else
    emit(drawn_edge(v_patch[0]));
#endif
}

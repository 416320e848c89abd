// SPDX-License-Identifier: MIT
// An edge with what it counts becomes a patch of as many quads; or, IS_TRIANGLE, a caster one of
// the three sides behind it, and, HAS_CAP, of itself. Needs: those of volume_quads.glsl;
// IS_TRIANGLE, HAS_CAP.
#include "shadows/volume_quads.glsl"
#define PATCH patch out
#include "shadows/volume_patch.glsl"
layout(vertices = 1) out;
in uint v_patch[];

void put(int at, drawn_face d, uint quad)
{
    p_corners[2 * at] = vec4(d.quad.corners[0], d.quad.corners[1]);
    p_corners[2 * at + 1] = vec4(d.quad.corners[2], d.quad.corners[3]);
    p_told[at] = told_of(d, quad);
}

void main()
{
    uint columns = 0u;
#ifdef IS_TRIANGLE
    int faces = 0;
    for (uint i = 0u; i < VOLUME_PATCH_FACES; i++) {
        drawn_face d = drawn_face_of(v_patch[0], i);
        if (d.count > 0u)
            put(faces++, d, 0u);
    }
    columns = uint(faces) * VOLUME_FACE_COLUMNS;
#else
    drawn_face d = drawn_edge(v_patch[0]);
    if (d.count > 0u)
        put(0, d, 0u);
    p_told[0].y &= ~(VOLUME_GROUP_MASK | VOLUME_IS_LOST);
    p_log2 = d.face.log2;
    p_stops = d.face.stops;
    p_first = d.first;
    columns = 2u * d.count;
#endif
    float across = float(columns) - 1.0;
    p_columns = across;
    gl_TessLevelInner[0] = across;
    gl_TessLevelInner[1] = 1.0;
    gl_TessLevelOuter[0] = columns > 0u ? 1.0 : 0.0; // none: nothing is drawn
    gl_TessLevelOuter[1] = across;
    gl_TessLevelOuter[2] = 1.0;
    gl_TessLevelOuter[3] = across;
}

// SPDX-License-Identifier: MIT
// Bends the strip that the tessellator made into quads, one upon another. Of an edge, columns of
// two points go to and fro, and every other cell has no area: AB, CD, DC, BA, AB, CD and so on. Of
// a triangle, quads are apart: columns AA, AB, CD, DD for each. Needs: IS_TRIANGLE, HAS_CAP.
layout(quads, equal_spacing, ccw) in;
#include "shared/bindings.h"
#include "shadows/volume_told.glsl"
#define PATCH patch in
#include "shadows/volume_patch.glsl"
flat out uvec2 v_told;

void main()
{
    uint column = uint(gl_TessCoord.x * p_columns + 0.5);
    uint row = gl_TessCoord.y > 0.25 ? 1u : 0u; // a device may halve the strip along its way
#ifdef IS_TRIANGLE
    const uint corners[8] = uint[](0u, 0u, 0u, 1u, 2u, 3u, 3u, 3u);
    uint face = column / VOLUME_FACE_COLUMNS;
    uint corner = corners[2u * (column % VOLUME_FACE_COLUMNS) + row];
    v_told = p_told[face];
#else
    const uint corners[8] = uint[](0u, 1u, 2u, 3u, 3u, 2u, 1u, 0u);
    uint face = 0u, corner = corners[2u * (column % 4u) + row];
    v_told = p_told[0] | uvec2(0u, volume_told_at(p_log2, p_stops, p_first + column / 2u));
#endif
    vec4 pair = p_corners[2u * face + corner / 2u];
    gl_Position = vec4(corner % 2u == 0u ? pair.xy : pair.zw, 0.5, 1.0);
}

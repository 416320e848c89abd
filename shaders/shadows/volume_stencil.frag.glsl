// SPDX-License-Identifier: MIT
// A quad that is drawn about a face of a shadow volume lets the stencil count, where the way to one
// point of the pixel crosses the face, and the face is of one group of casters: front faces are
// those that the way gains a caster at. Needs: those of volume.glsl.
#include "shadows/volume.glsl"
#include "shadows/volume_faces.glsl"
#include "shadows/volume_told.glsl"
#include "shadows/volume_corners.glsl"
#include "shadows/volume_crossing.glsl"
uniform uvec2 u_size_px;
uniform uint u_turn, u_slot; // the group, and the point's number in its pixel

void main()
{
    if ((v_told.y & VOLUME_GROUP_MASK) != u_turn)
        discard;
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    pixel_points points = points_of(pixel.y * u_size_px.x + pixel.x);
    if (u_slot >= points.count)
        discard;
    vec4 start = starts[point_at(points, u_slot)];
    uint kind = v_told.y >> VOLUME_KIND_SHIFT;
    int side = (v_told.y & VOLUME_IS_BEFORE) != 0u ? 1 : -1;
    volume_face face = volume_face(ivec3(0), side, ivec3(0), 0u);
    looked_at at = looked_at(corners_of(kind), kind != VOLUME_KIND_CAP, face);
    int found = start.w == 0.0 ? 0 : crossing(at, start.xyz, false);
    if (found < 0)
        found = crossing(at, start.xyz, true);
    if (found <= 0)
        discard;
}

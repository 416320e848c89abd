// SPDX-License-Identifier: MIT
// A quad that is drawn about a face of a shadow volume counts one caster for all points of a pixel
// whose ways cross the face. Needs: those of volume.glsl.
#include "shadows/volume.glsl"
#include "shadows/volume_faces.glsl"
#include "shadows/volume_told.glsl"
#include "shadows/volume_corners.glsl"
#include "shadows/volume_crossing.glsl"
uniform uvec2 u_size_px;

void main()
{
    uint group = v_told.y & VOLUME_GROUP_MASK, kind = v_told.y >> VOLUME_KIND_SHIFT;
    int count = (v_told.y & VOLUME_IS_LOST) != 0u ? -1 : 1;
    volume_face face;
    face.side = (v_told.y & VOLUME_IS_BEFORE) != 0u ? 1 : -1;
    face.log2 = count * ivec3(equal(uvec3(group), uvec3(0u, 1u, 2u)));
    face.stops = count * ivec3(equal(uvec3(group), uvec3(3u, 4u, 5u)));
    looked_at at = looked_at(corners_of(kind), kind != VOLUME_KIND_CAP, face);
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    bool is_open = false;
    cross_points(at, pixel.y * u_size_px.x + pixel.x, false, is_open);
    if (is_open)
        cross_points(at, pixel.y * u_size_px.x + pixel.x, true, is_open);
}

// SPDX-License-Identifier: MIT
// The corners of a face that a stage has drawn about. Needs: volume.glsl, volume_faces.glsl and
// volume_told.glsl before it.
flat in uvec2 v_told;

vec4[3] corners_of(uint kind)
{
    if (kind == VOLUME_KIND_EDGE) {
        uvec2 v = edges[v_told.x].xy;
        return vec4[](volume_vertex(v.x), volume_vertex(v.y), u_light);
    }
    uvec3 v = triangles[v_told.x].xyz;
    if (kind == VOLUME_KIND_CAP)
        return vec4[](volume_vertex(v.x), volume_vertex(v.y), volume_vertex(v.z));
    return vec4[](volume_vertex(kind == 2u ? v.y : v.x), volume_vertex(kind == 0u ? v.y : v.z),
                  u_light);
}

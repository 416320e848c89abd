// SPDX-License-Identifier: MIT
// What a face of a shadow volume counts, by the sides of its triangles on which the light is. These
// are found once, for all edges of a triangle. Needs: volume.glsl and volume_faces.glsl before it.
layout(std430, binding = BIND_VOLUME_SIDES) readonly buffer side_buffer { uvec2 sides[]; };
layout(std430, binding = BIND_VOLUME_SIGNS) readonly buffer sign_buffer { int signs[]; };

volume_face volume_side_behind(uint i)
{
    uvec4 edge = edges[i];
    volume_face f = volume_face(ivec3(0), 0, ivec3(0), i);
    for (uint k = edge.z; k < edge.z + edge.w; k++) {
        uvec2 side = sides[k];
        // in the outline of a triangle of rising vertices, the edge of the first and last is turned
        int sign = side.x > edge.x && side.x < edge.y ? -signs[side.y] : signs[side.y];
        volume_loss loss = volume_loss_of(triangles[side.y].w);
        f.log2 += sign * loss.log2;
        f.stops += sign * loss.stops;
    }
    return f;
}

// Times `turned`: 1, or -1.
volume_face volume_cap(uint triangle, int turned)
{
    volume_loss loss = volume_loss_of(triangles[triangle].w);
    int sign = turned * signs[triangle];
    return volume_face(sign * loss.log2, 0, sign * loss.stops, 0u);
}

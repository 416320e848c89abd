// SPDX-License-Identifier: MIT
// An invocation for each edge: those whose triangles do not cancel, the silhouette as the light
// sees it, are listed, each with what its side face counts. Needs: those of volume.glsl.
#include "shadows/volume.glsl"
layout(local_size_x = 64) in;
#include "shadows/volume_faces.glsl"
layout(std430, binding = BIND_VOLUME_FACES) writeonly buffer face_buffer { volume_face faces[]; };
layout(std430, binding = BIND_VOLUME_SIDES) readonly buffer side_buffer { uvec2 sides[]; };
layout(std430, binding = BIND_VOLUME_SIGNS) readonly buffer sign_buffer { int signs[]; };
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { uint counters[]; };
uniform uint u_edge_count;

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_edge_count)
        return;
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
    if (f.log2 != ivec3(0) || f.stops != ivec3(0))
        faces[atomicAdd(counters[VOLUME_EDGES], 1u)] = f;
}

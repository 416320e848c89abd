// SPDX-License-Identifier: MIT
// An invocation for each edge: those whose triangles do not cancel, the silhouette as the light
// sees it, are listed, each with what its side face counts. Needs: those of volume.glsl; IS_DRAWN:
// all edges are listed in their order, as faces are blended.
#include "shadows/volume.glsl"
layout(local_size_x = 64) in;
#include "shadows/volume_faces.glsl"
#include "shadows/volume_counts.glsl"
layout(std430, binding = BIND_VOLUME_FACES) writeonly buffer face_buffer { volume_face faces[]; };
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { uint counters[]; };
uniform uint u_edge_count;

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_edge_count)
        return;
    volume_face f = volume_side_behind(i);
#ifdef IS_DRAWN
    faces[i] = f;
#else
    if (f.log2 != ivec3(0) || f.stops != ivec3(0))
        faces[atomicAdd(counters[VOLUME_EDGES], 1u)] = f;
#endif
}

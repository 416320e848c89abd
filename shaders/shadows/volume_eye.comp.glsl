// SPDX-License-Identifier: MIT
// What light loses on its way to the eye, an invocation for each triangle: with what the way from
// there on gains, it is what light loses on its way to a point. Needs: those of volume.glsl.
#include "shadows/volume.glsl"
layout(local_size_x = 64) in;
#include "shadows/volume_faces.glsl"
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { int counters[]; };
uniform uint u_triangles;

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_triangles)
        return;
    uvec4 v = triangles[i];
    if (!volume_is_reached(v.w))
        return;
    int light = volume_side_of_light(v.xyz);
    if (light == 0 || volume_side_of_eye(volume_vertex(v.x), volume_vertex(v.y),
                                         volume_vertex(v.z)) != -light)
        return;
    int side = volume_side_of_edge(v.xy);
    if (side == 0 || volume_side_of_edge(v.yz) != side || volume_side_of_edge(v.xz) != -side)
        return;
    volume_loss loss = volume_loss_of(v.w);
    for (uint k = 0u; k < 3u; k++) {
        atomicAdd(counters[VOLUME_OF_EYE + k], loss.log2[k]);
        atomicAdd(counters[VOLUME_OF_EYE + 3u + k], loss.stops[k]);
    }
}

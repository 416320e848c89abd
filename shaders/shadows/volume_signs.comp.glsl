// SPDX-License-Identifier: MIT
// An invocation for each triangle: on which side of it the light is, which all its edges ask for;
// and what light loses on its way to the eye: with what the way from there on gains, it is what
// light loses on its way to a point. Needs: those of volume.glsl.
#include "shadows/volume.glsl"
layout(local_size_x = 64) in;
#include "shadows/volume_faces.glsl"
layout(std430, binding = BIND_VOLUME_SIGNS) writeonly buffer sign_buffer { int signs[]; };
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { int counters[]; };
uniform uint u_triangles;

// Whether the triangle is between the light and the eye, of which its plane and those through its
// edges and the light tell. Few triangles are, and fewer hang on a hair.
bool is_before_eye(vec4 v[3], int light)
{
    ivec3 turns = ivec3(volume_side_by_floats(volume_eye(), v[0], v[1], u_light),
                        volume_side_by_floats(volume_eye(), v[1], v[2], u_light),
                        -volume_side_by_floats(volume_eye(), v[0], v[2], u_light));
    bool is_beside = min(turns.x, min(turns.y, turns.z)) < 0 &&
                     max(turns.x, max(turns.y, turns.z)) > 0;
    bool is_apart = is_beside || volume_side_by_floats(volume_eye(), v[0], v[1], v[2]) == light;
    int sides[4] = int[](light, 0, 0, 0);
    for (int k = is_apart ? 4 : 0; k < 4; k++)
        sides[k] = volume_side_of_eye(k == 2 ? v[1] : v[0], k < 2 ? v[1] : v[2],
                                      k == 0 ? v[2] : u_light);
    return sides[0] == -light && sides[1] != 0 && sides[2] == sides[1] && sides[3] == -sides[1];
}

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_triangles)
        return;
    uvec4 of = triangles[i];
    vec4 v[3] = vec4[](volume_vertex(of.x), volume_vertex(of.y), volume_vertex(of.z));
    int light = volume_is_reached(of.w) ? volume_side(u_light, v[0], v[1], v[2]) : 0;
    signs[i] = light;
    if (light == 0 || !is_before_eye(v, light))
        return;
    volume_loss loss = volume_loss_of(of.w);
    for (uint k = 0u; k < 3u; k++) {
        atomicAdd(counters[VOLUME_OF_EYE + k], loss.log2[k]);
        atomicAdd(counters[VOLUME_OF_EYE + 3u + k], loss.stops[k]);
    }
}

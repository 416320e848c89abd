// SPDX-License-Identifier: MIT
// A face of a shadow volume as two triangles of the window: a caster, or the side behind an edge,
// which goes from the light away without end. Needs: those of volume.glsl.
#include "shadows/volume.glsl"
#include "shadows/volume_faces.glsl"
#include "shadows/volume_window.glsl"
layout(std430, binding = BIND_VOLUME_FACES) readonly buffer face_buffer { volume_face faces[]; };
uniform uvec2 u_size_px; // of the window
flat out uint v_face;

vec4 away(vec4 a)
{
    return vec4(a.xyz * u_light.w - u_light.xyz, 0.0);
}

// Where it is seen in the window. Nothing is cut but what is behind the eye.
vec4 clip_of(vec4 a)
{
    float h = height_of(a);
    vec2 pixel = (a.xy - u_window.xy * h) / u_window.zw - vec2(u_window_first) * h;
    return vec4(2.0 * pixel / vec2(u_size_px) - h, 0.0, h);
}

void main()
{
    const uint corners[6] = uint[](0u, 1u, 2u, 0u, 2u, 3u);
    uint i = uint(gl_VertexID) / 6u, corner = corners[uint(gl_VertexID) % 6u];
    volume_face f = faces[i];
    bool is_side = i < u_edges;
    v_face = i;
    gl_Position = vec4(2.0, 2.0, 0.0, 1.0); // all of them: nothing is drawn
    if (f.side == 0 || (!is_side && gl_VertexID % 6 > 2))
        return;
    uvec3 v = is_side ? uvec3(edges[f.edge].xy, 0u) : triangles[i - u_edges].xyz;
    bool is_first = corner == 0u || corner == 3u, is_second = corner == 1u || is_side;
    vec4 a = volume_vertex(is_first ? v.x : is_second ? v.y : v.z);
    gl_Position = clip_of(is_side && corner > 1u ? away(a) : a);
}

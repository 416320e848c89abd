// SPDX-License-Identifier: MIT
// The points of the entries of the pixels' lists, where traced shadows are asked for.
// Needs: those of shadow_points.glsl.
#include "shadows/shadow_points.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_FRAGMENT_KEYS) readonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_0) readonly buffer s0_buffer { uvec4 surfaces_0[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_1) readonly buffer s1_buffer { uvec4 surfaces_1[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_2) readonly buffer s2_buffer { uvec4 surfaces_2[]; };
layout(std430, binding = BIND_FRAGMENT_COLORS) readonly buffer color_buffer { vec4 colors[]; };
uniform uint u_entries;
uniform uint u_keys_offset; // of the sorted half

// In the middle of the samples that the triangle covers: at the pixel's middle its plane may be
// beside it, and behind its neighbours.
vec3 point_position(surface s, vec2 pixel, uint coverage, float depth)
{
    vec2 sum = vec2(0.0);
    for (int j = 0; j < SAMPLES; j++)
        if ((coverage & 1u << j) != 0u)
            sum += u_sample_positions[j] - 0.5;
    vec2 offset = sum / float(max(bitCount(coverage & ((1u << SAMPLES) - 1u)), 1));
    float view_z = view_depth(depth);
    vec3 middle = view_position(pixel + 0.5, view_z);
    vec3 aside = view_position(pixel + 0.5 + offset, view_z);
    vec3 view = view_direction(aside);
    float across = dot(s.geo_normal, view); // along the view onto the plane
    if (abs(across) < 1e-3)
        return middle;
    float way = dot(s.geo_normal, middle - aside) / across;
    return aside + clamp(way, -0.5 * view_z, 0.5 * view_z) * view;
}

void main()
{
    uint at = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
              gl_LocalInvocationID.x;
    if (at >= u_entries)
        return;
    uvec4 key = keys[u_keys_offset + at];
    uint entry = key.z;
    uvec4 extra = surfaces_2[entry];
    surface s = surface_unpack(surfaces_0[entry], surfaces_1[entry]);
    vec2 pixel = vec2(extra.z % u_size_px.x, extra.z / u_size_px.x);
    shadow_point p;
    p.position_offset = vec4(point_position(s, pixel, key.w, uintBitsToFloat(extra.w)), 0.0);
    p.geo_normal = surfaces_0[entry].y;
    p.normal = surfaces_0[entry].x;
    p.pixel = extra.z;
    p.flags = point_flags(s, colors[2u * entry + 1u].w > 0.0);
    points[entry] = p;
}

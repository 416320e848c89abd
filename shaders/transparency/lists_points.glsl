// SPDX-License-Identifier: MIT
// The points of the entries of the per-pixel lists, in the order of the sorted keys, which have the
// coverage. Needs: shadow_points_surfaces.comp.glsl. Provides: surface_point.
layout(std430, binding = BIND_ENTRY_KEYS) readonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_0) readonly buffer s0_buffer { uvec4 surfaces_0[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_1) readonly buffer s1_buffer { uvec4 surfaces_1[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_2) readonly buffer s2_buffer { uvec4 surfaces_2[]; };
layout(std430, binding = BIND_ENTRY_COLORS) readonly buffer color_buffer { vec4 colors[]; };
uniform uint u_keys_offset; // of the sorted half

uint surface_point(uint i, out shadow_point p)
{
    uvec4 key = keys[u_keys_offset + i];
    uint entry = key.z;
    uvec4 extra = surfaces_2[entry];
    surface s = surface_unpack(surfaces_0[entry], surfaces_1[entry]);
    vec2 pixel = vec2(extra.z % u_size_px.x, extra.z / u_size_px.x);
    p.position_offset = vec4(point_position(s, pixel, key.w, uintBitsToFloat(extra.w)), 0.0);
    p.geo_normal = surfaces_0[entry].y;
    p.normal = surfaces_0[entry].x;
    p.pixel_roughness = point_place(extra.z, s);
    p.flags = point_flags(s, colors[2u * entry + 1u].w > 0.0);
    return entry;
}

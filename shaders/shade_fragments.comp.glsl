// SPDX-License-Identifier: MIT
// Shades every entry of the per-pixel lists: its radiance towards the viewer. What it lets through
// was written with it (lists_scatter.frag.glsl).
#include "lighting.glsl"
#include "view_ray.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_0) readonly buffer s0_buffer { uvec4 surfaces_0[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_1) readonly buffer s1_buffer { uvec4 surfaces_1[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_2) readonly buffer s2_buffer { uvec4 surfaces_2[]; };
layout(std430, binding = BIND_FRAGMENT_COLORS) buffer color_buffer { vec4 colors[]; };
uniform uint u_first_entry; // of the dispatch
uniform uint u_entries;     // before its end
uniform uint u_width_px;
uniform uint u_pixels;

void main()
{
    uint entry = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationID.x + u_first_entry;
    if (entry >= min(u_entries, ends[u_pixels - 1u]))
        return;
    uvec4 extra = surfaces_2[entry];
    surface s = surface_unpack(surfaces_0[entry], surfaces_1[entry]);
    float transmission = uintBitsToFloat(extra.x);
#ifdef HAS_MEDIA
    if ((materials[s.material].flags & MATERIAL_MEDIUM) != 0u)
        transmission = unpack_factor(extra.xy);
#endif
    float coverage = colors[2u * entry + 1u].w; // the surface's own alpha has 16 bits
    uvec2 pixel = uvec2(extra.z % u_width_px, extra.z / u_width_px);
    float view_z = view_depth(uintBitsToFloat(extra.w));
    vec3 position = view_position(vec2(pixel) + 0.5, view_z);
    vec3 view = view_direction(position);
    vec3 radiance = vec3(0.0);
#ifdef HAS_TRACED_SHADOWS
    traced_begin(entry);
#endif
#ifdef HAS_LIGHT_PARTS
    vec3 before = colors[2u * entry].rgb;
#else
    const vec3 before = vec3(0.0);
#endif
    if (coverage > 0.0)
        radiance = lighting_evaluate(s, transmission, position, view, pixel, view_z, before);
    colors[2u * entry] = vec4(radiance, 0.0);
}

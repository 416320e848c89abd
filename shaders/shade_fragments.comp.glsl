// SPDX-License-Identifier: MIT
// Shades every entry of the per-pixel lists: radiance towards the viewer, and what it lets through.
#include "lighting.glsl"
#include "view_ray.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_FRAGMENT_SURFACE_0) readonly buffer s0_buffer { uvec4 surfaces_0[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_1) readonly buffer s1_buffer { uvec4 surfaces_1[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_2) readonly buffer s2_buffer { uvec4 surfaces_2[]; };
layout(std430, binding = BIND_FRAGMENT_COLORS) writeonly buffer color_buffer { vec4 colors[]; };
uniform uint u_entries;
uniform uint u_width_px;

#ifdef HAS_MEDIA
// The back face of a medium whose material is single-sided: crossed, but not drawn.
bool is_left_unseen(surface s)
{
    uint flags = materials[s.material].flags;
    return (flags & MATERIAL_MEDIUM) != 0u && !s.is_front && (flags & MATERIAL_DOUBLE_SIDED) == 0u;
}
#endif

// The camera's share of the filter: blended surfaces cover (glTF 2.0, 3.9.4), transmissive ones
// filter what the dielectric interface did not reflect (KHR_materials_transmission).
vec3 camera_filter(surface s, float transmission, float thickness_m, float n_dot_v)
{
    material_record r = materials[s.material];
    if ((r.flags & MATERIAL_TRANSMISSION) == 0u)
        return vec3(1.0 - s.alpha);
    vec3 t = material_filter(s.material, vec4(s.base, s.alpha), transmission, thickness_m, n_dot_v,
                             s.is_front, BLEND_COVERAGE);
    float through = 1.0 - s.alpha * dielectric_fresnel(r.transmission_f0_thickness.y, n_dot_v);
#ifdef HAS_MEDIA
    if (is_left_unseen(s))
        through = 1.0; // its reflection is not drawn, so nothing is taken for it
#endif
    return t * through * (1.0 - s.alpha * s.metallic);
}

void main()
{
    uint entry = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationID.x;
    if (entry >= u_entries)
        return;
    uvec4 extra = surfaces_2[entry];
    surface s = surface_unpack(surfaces_0[entry], surfaces_1[entry]);
    float transmission = uintBitsToFloat(extra.x), thickness_m = uintBitsToFloat(extra.y);
    bool is_lit = s.alpha > 0.0;
#ifdef HAS_MEDIA
    is_lit = is_lit && !is_left_unseen(s);
    if ((materials[s.material].flags & MATERIAL_MEDIUM) != 0u) {
        transmission = unpack_factor(extra.xy);
        thickness_m = 0.0; // the way through it attenuates instead: shade_pixels.comp.glsl
    }
#endif
    uvec2 pixel = uvec2(extra.z % u_width_px, extra.z / u_width_px);
    float view_z = view_depth(uintBitsToFloat(extra.w));
    vec3 position = view_position(vec2(pixel) + 0.5, view_z);
    vec3 view = view_direction(position);
    vec3 radiance = vec3(0.0);
    if (is_lit)
        radiance = s.alpha * lighting_evaluate(s, transmission, position, view, pixel, view_z);
    vec3 filter_ = camera_filter(s, transmission, thickness_m, abs(dot(s.normal, view)));
    colors[2u * entry] = vec4(radiance, 0.0);
    colors[2u * entry + 1u] = vec4(filter_, 0.0);
}

// SPDX-License-Identifier: MIT
// Entries of entry_scatter.glsl as surfaces to be lit. What an entry lets through was written with
// it; its radiance towards the viewer comes beside it. Of the ground plane that is turned over: it
// sends nothing, and its light is what it lets through.
// Needs: lighting.glsl, view_ray.glsl. Provides: surface_load, surface_store.
layout(std430, binding = BIND_ENTRY_SURFACE_0) readonly buffer s0_buffer { uvec4 surfaces_0[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_1) readonly buffer s1_buffer { uvec4 surfaces_1[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_2) readonly buffer s2_buffer { uvec4 surfaces_2[]; };
layout(std430, binding = BIND_ENTRY_COLORS) buffer color_buffer { vec4 colors[]; };
#ifdef HAS_LOBES
layout(std430, binding = BIND_ENTRY_LOBES) readonly buffer lobes_buffer {
    uvec4 lobes_words[];
};
#endif
#ifdef HAS_MORE_LOBES
layout(std430, binding = BIND_ENTRY_MORE_LOBES) readonly buffer more_lobes_buffer {
    uvec4 more_lobes_words[];
};
#endif
uniform uint u_width_px;
#ifdef HAS_GROUND
#include "transparency/lists_ground.glsl"
#endif

bool surface_load(uint entry, out lit_surface at)
{
    uvec4 extra = surfaces_2[entry];
    at.s = surface_unpack(surfaces_0[entry], surfaces_1[entry]);
#ifdef HAS_LOBES
    at.lobes = lobes_words[entry];
#endif
#ifdef HAS_MORE_LOBES
    at.more_lobes = more_lobes_words[entry];
#endif
    at.transmission = uintBitsToFloat(extra.x);
#ifdef HAS_MEDIA
    if ((materials[at.s.material].flags & MATERIAL_MEDIUM) != 0u)
        at.transmission = unpack_factor(extra.xy);
#endif
    at.pixel = uvec2(extra.z % u_width_px, extra.z / u_width_px);
    at.view_z = view_depth(uintBitsToFloat(extra.w));
    at.position = view_position(vec2(at.pixel) + 0.5, at.view_z);
    at.view = view_direction(at.position);
#ifdef HAS_TRACED_SHADOWS
    traced_begin(entry);
#endif
#ifdef HAS_ENVIRONMENT_VISIBILITY
    visibility_begin(entry);
#endif
#ifdef HAS_LIGHT_PARTS
    at.before = colors[2u * entry].rgb;
#else
    at.before = vec3(0.0);
#endif
#ifdef HAS_GROUND
    at.unshadowed = colors[2u * entry + 1u].rgb; // of the ground between two parts
#endif
    float coverage = colors[2u * entry + 1u].w; // the surface's own alpha has 16 bits
    return coverage > 0.0;
}

void surface_store(uint entry, vec3 radiance)
{
#ifdef HAS_GROUND
    if (is_ground(surfaces_1[entry].w)) {
        ground_store(entry, radiance);
        return;
    }
#endif
    colors[2u * entry] = vec4(radiance, 0.0);
}

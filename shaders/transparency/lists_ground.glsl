// SPDX-License-Identifier: MIT
// Entries of the ground plane: what they let through is the share of the light that arrives, of
// what would arrive without shadows, fading to all of it with the distance
// (renderer/scene/ground_plane.c). Between the parts of the lights, an entry's light and its filter
// hold the two sums. Needs: lighting.glsl, view_ray.glsl, those of lists_surfaces.glsl. Provides:
// is_ground, ground_store.
#include "material/filter_word.glsl"
uniform vec3 u_ground_center; // view space [m]
uniform vec2 u_ground_range;  // [m] from there: where shadows begin to fade, and end

bool is_ground(uint material)
{
    return (materials[material].flags & MATERIAL_GROUND) != 0u;
}

// The share of light that is missing.
vec3 ground_missing(vec3 arriving, vec3 unshadowed, vec3 position)
{
    vec3 missing = clamp(1.0 - arriving / max(unshadowed, vec3(1e-37)), vec3(0.0), vec3(1.0));
    missing = mix(vec3(0.0), missing, greaterThan(unshadowed, vec3(0.0)));
    return missing * (1.0 - smoothstep(u_ground_range.x, u_ground_range.y,
                                       distance(position, u_ground_center)));
}

void ground_store(uint entry, vec3 arriving)
{
    uvec4 extra = surfaces_2[entry];
    uvec2 pixel = uvec2(extra.z % u_width_px, extra.z / u_width_px);
    vec3 position = view_position(vec2(pixel) + 0.5, view_depth(uintBitsToFloat(extra.w)));
    vec3 missing = ground_missing(arriving, light_unshadowed, position);
    colors[2u * entry] = vec4(IS_LAST_PART ? vec3(0.0) : arriving, 0.0);
    colors[2u * entry + 1u].rgb =
        IS_LAST_PART ? filter_pack(1.0 - missing, missing) : light_unshadowed;
}

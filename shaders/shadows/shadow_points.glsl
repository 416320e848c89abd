// SPDX-License-Identifier: MIT
// A point that traced shadows are asked for. Needs: IS_ORTHOGRAPHIC, SAMPLES.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "draw/surface.glsl"
#include "window/view_ray.glsl"
layout(std430, binding = BIND_MATERIALS) readonly buffer material_buffer {
    material_record materials[];
};
layout(std430, binding = BIND_TRACED_POINTS) writeonly buffer point_buffer {
    shadow_point points[];
};
uniform uvec2 u_size_px;
uniform vec2 u_sample_positions[SAMPLES]; // in the pixel, y up

uint point_flags(surface s, bool is_lit)
{
    uint flags = materials[s.material].flags;
    is_lit = is_lit && (flags & MATERIAL_UNLIT) == 0u;
    bool transmits = (flags & (MATERIAL_TRANSMISSION | MATERIAL_TRANSLUCENT)) != 0u;
    return (is_lit ? 0u : SHADOW_POINT_UNLIT) | (transmits ? SHADOW_POINT_TRANSMITS : 0u) |
           ((flags & MATERIAL_NO_SELF_SHADOW) != 0u ? (s.node + 1u) << SHADOW_POINT_EXCLUDED_NODE
                                                    : 0u);
}

uint point_place(uint pixel, surface s)
{
    return pixel | uint(clamp(s.roughness, 0.0, 1.0) * 255.0 + 0.5) << SHADOW_POINT_PIXEL_BITS;
}

// SPDX-License-Identifier: MIT
// Auxiliary outputs of the nearest surface of each pixel, opaque or transparent: nine words a
// pixel.
// Needs: SAMPLES, HAS_TRANSPARENT, HAS_MEDIA, IS_ORTHOGRAPHIC.
// Values are those of the pixel's first sample,
// never averaged.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "surface.glsl"
#include "view_ray.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
#if SAMPLES > 1
layout(binding = UNIT_GBUFFER_0) uniform usampler2DMS u_surface_0;
layout(binding = UNIT_GBUFFER_1) uniform usampler2DMS u_surface_1;
layout(binding = UNIT_GBUFFER_DEPTH) uniform sampler2DMS u_depth_map;
#else
layout(binding = UNIT_GBUFFER_0) uniform usampler2D u_surface_0;
layout(binding = UNIT_GBUFFER_1) uniform usampler2D u_surface_1;
layout(binding = UNIT_GBUFFER_DEPTH) uniform sampler2D u_depth_map;
#endif
layout(std430, binding = BIND_MATERIALS) readonly buffer material_buffer {
    material_record materials[];
};
layout(std430, binding = BIND_STATISTICS) writeonly buffer aov_buffer { uint words[]; };
uniform uvec2 u_size_px;
#ifdef HAS_TRANSPARENT
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
layout(std430, binding = BIND_FRAGMENT_KEYS) readonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_0) readonly buffer s0_buffer { uvec4 surfaces_0[]; };
layout(std430, binding = BIND_FRAGMENT_SURFACE_1) readonly buffer s1_buffer { uvec4 surfaces_1[]; };
uniform uint u_keys_offset;
#endif

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, u_size_px)))
        return;
    uvec4 s0 = texelFetch(u_surface_0, pixel, 0), s1 = texelFetch(u_surface_1, pixel, 0);
    float depth = texelFetch(u_depth_map, pixel, 0).x;
    uint index = gl_GlobalInvocationID.y * u_size_px.x + gl_GlobalInvocationID.x;
#ifdef HAS_TRANSPARENT
    uint first = index == 0u ? 0u : ends[index - 1u], end = ends[index];
    for (uint k = first; k < end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        if ((key.w & 1u) == 0u || (surfaces_1[key.z].y >> 16) == 0u)
            continue; // misses the first sample, or covers nothing
#ifdef HAS_MEDIA
        uvec4 candidate = surfaces_1[key.z];
        uint flags = materials[candidate.w].flags;
        bool is_back = (candidate.z & 0x80000000u) == 0u;
        if ((key.w & FRAGMENT_HIDDEN) != 0u ||
            ((flags & MATERIAL_MEDIUM) != 0u && is_back && (flags & MATERIAL_DOUBLE_SIDED) == 0u))
            continue; // is there for its medium only
#endif
        s0 = surfaces_0[key.z];
        s1 = surfaces_1[key.z];
        depth = uintBitsToFloat(key.x);
        break;
    }
#endif
    uint at = 9u * index;
    bool is_hit = depth > 0.0;
    surface s = surface_unpack(s0, s1);
    vec3 normal = is_hit ? s.normal : vec3(0.0), base = is_hit ? s.base : vec3(0.0);
    words[at] = is_hit ? floatBitsToUint(view_depth(depth)) : 0x7f800000u;
    for (uint i = 0u; i < 3u; i++) {
        words[at + 1u + i] = floatBitsToUint(normal[i]);
        words[at + 4u + i] = floatBitsToUint(base[i]);
    }
    words[at + 7u] = is_hit ? s.node + 1u : 0u;
    words[at + 8u] = is_hit ? materials[s.material].source + 1u : 0u;
}

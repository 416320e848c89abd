// SPDX-License-Identifier: MIT
// Auxiliary outputs of each pixel: AOV_WORDS words, those of an output from AT_<OUTPUT> on; an
// output that was not asked for has no AT_ and leaves nothing behind (renderer/shading/aov.c).
// Needs: AOV_WORDS, AT_*, SAMPLES, HAS_TRANSPARENT, HAS_GROUND (it is among these, and none of the
// outputs knows it), IS_ORTHOGRAPHIC, those of media.glsl, and with
// AT_LIGHTS HAS_LIGHTS and those of light_list.glsl; with AT_OPTICAL_DEPTH HAS_HAZE and those of
// density_grids.glsl.
// Values are those of the nearest surface at the pixel's first sample, never averaged.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "base/wide.glsl"
#include "material/material.glsl"
#include "draw/surface.glsl"
#include "window/view_ray.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
#include "window/gbuffer.glsl"
layout(std430, binding = BIND_STATISTICS) writeonly buffer aov_buffer { uint words[]; };
uniform uvec2 u_size_px;
uniform vec3 u_world_x, u_world_y, u_world_z; // in view space
uniform vec2 u_sample_positions[SAMPLES]; // in the pixel, y up
#ifdef HAS_TRANSPARENT
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
layout(std430, binding = BIND_ENTRY_KEYS) readonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_0) readonly buffer s0_buffer { uvec4 surfaces_0[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_1) readonly buffer s1_buffer { uvec4 surfaces_1[]; };
uniform uint u_keys_offset;
#endif
#if defined AT_LIGHTS && defined HAS_LIGHTS
#include "lights/light_list.glsl"
#endif
#if defined HAS_TRANSPARENT && (defined AT_TRANSMITTANCE || defined AT_OPTICAL_DEPTH)
#define FOLLOWS_LIST
#include "material/filter_unpack.glsl"
#define WALKS 1 // the first sample alone
#include "material/media.glsl"
layout(std430, binding = BIND_ENTRY_COLORS) readonly buffer color_buffer { vec4 colors[]; };
#endif
#ifdef HAS_HAZE
#include "shading/atmosphere.glsl"
#endif
#ifdef GRID_COUNT
#include "lights/density_grids.glsl"
#endif

#ifdef HAS_TRANSPARENT
bool is_ground(uvec4 key)
{
#ifdef HAS_GROUND
    return (materials[surfaces_1[key.z].w].flags & MATERIAL_GROUND) != 0u;
#else
    return false;
#endif
}

// Whether the entry is a surface that the first sample shows.
bool is_shown(uvec4 key)
{
    uvec4 s1 = surfaces_1[key.z];
    bool is_shown = (key.w & 1u) != 0u && (s1.y >> 16) != 0u; // else it misses, or covers nothing
#ifdef HAS_MEDIA
    uint flags = materials[s1.w].flags;
    bool is_back = (s1.z & 0x80000000u) == 0u;
    is_shown = is_shown && (key.w & ENTRY_HIDDEN) == 0u &&
               ((flags & MATERIAL_MEDIUM) == 0u || !is_back ||
                (flags & MATERIAL_DOUBLE_SIDED) != 0u); // else it is there for its medium only
#endif
    return is_shown;
}
#endif

#ifdef FOLLOWS_LIST
struct list_seen {
    vec3 share; // of light that filters let through
    vec3 depth; // optical depth of media
};

// To the opaque surface, as shade_pixels.comp.glsl composites layers.
list_seen follow_list(ivec2 pixel, uint first, uint end)
{
    wide3 share = share_all();
    vec3 tau = vec3(0.0);
#ifdef HAS_MEDIA
    float depth[WALKS] = float[](texelFetch(u_depth_map, pixel, 0).x);
    media_begin_list(pixel, depth, first, end);
#endif
    for (uint k = first; k < end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        if ((key.w & 1u) == 0u || is_ground(key))
            continue;
#ifdef HAS_MEDIA
        medium_event e = media_event(key.z, uintBitsToFloat(key.x));
        media_meet(0, e);
        media_cross(0, e);
        if ((key.w & ENTRY_HIDDEN) != 0u)
            continue;
#endif
        share = share_filter(share, filter_unpack(colors[2u * key.z + 1u].rgb));
    }
#ifdef HAS_MEDIA
    media_end(0, depth[0]);
    tau = max(wide_round(media_tau[0]), 0.0);
#endif
    return list_seen(share_round(share), tau);
}
#endif

#ifdef AT_OPTICAL_DEPTH
// Of haze and density grids, to the opaque surface or without an end.
float depth_of_air(vec2 at, float depth)
{
#ifdef HAS_HAZE
    vec3 eye = view_position(at, 0.0);
    if (depth > 0.0)
        return atmosphere_depth(eye, view_position(at, view_depth(depth)));
    return atmosphere_depth_without_end(eye, normalize(view_position(at, 1.0) - eye));
#else
    return 0.0;
#endif
}

vec3 depth_of_smoke(vec2 at, float depth)
{
    vec3 sum = vec3(0.0);
#ifdef GRID_COUNT
    vec3 eye = view_position(at, 0.0), way = view_position(at, 1.0) - eye;
    float per_depth = length(way), end = depth > 0.0 ? view_depth(depth) * per_depth : GRID_FAR;
    way /= per_depth;
    vec2 range = grid_kept(eye, way, vec2(0.0, end), GRID_CUTS_ALL);
    for (uint g = 0u; g < uint(GRID_COUNT); g++)
        sum += grid_word(g, 4u).rgb * grid_sum(grid_meet(g, eye, way, range), GRID_FAR);
#endif
    return sum;
}
#endif

#ifdef AT_LIGHTS
uint count_lights(uvec2 pixel, float view_z)
{
#ifdef HAS_LIGHTS
    return light_list_count(light_list_first(pixel, view_z));
#else
    return 0u;
#endif
}
#endif

vec3 to_world(vec3 v)
{
    return vec3(dot(u_world_x, v), dot(u_world_y, v), dot(u_world_z, v));
}

void write_vector(uint at, vec3 value)
{
    for (uint i = 0u; i < 3u; i++)
        words[at + i] = floatBitsToUint(value[i]);
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, u_size_px)))
        return;
    uvec4 s0 = texelFetch(u_surface_0, pixel, 0), s1 = texelFetch(u_surface_1, pixel, 0);
    float opaque = texelFetch(u_depth_map, pixel, 0).x, depth = opaque;
    uint index = gl_GlobalInvocationID.y * u_size_px.x + gl_GlobalInvocationID.x;
    uint first = 0u, end = 0u;
#ifdef HAS_TRANSPARENT
    first = index == 0u ? 0u : ends[index - 1u];
    end = ends[index];
    for (uint k = first; k < end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        if (!is_shown(key) || is_ground(key))
            continue;
        s0 = surfaces_0[key.z];
        s1 = surfaces_1[key.z];
        depth = uintBitsToFloat(key.x);
        break;
    }
#endif
    uint at = uint(AOV_WORDS) * index;
    bool is_hit = depth > 0.0;
    surface s = surface_unpack(s0, s1);
    float view_z = view_depth(depth);
#ifdef AT_DEPTH
    words[at + AT_DEPTH] = is_hit ? floatBitsToUint(view_z) : 0x7f800000u;
#endif
#ifdef AT_POSITION // eye-relative, world axes; infinite where nothing is
    vec3 position = to_world(view_position(vec2(pixel) + u_sample_positions[0], view_z));
    write_vector(at + AT_POSITION, is_hit ? position : vec3(uintBitsToFloat(0x7f800000u)));
#endif
#ifdef AT_NORMAL
    write_vector(at + AT_NORMAL, is_hit ? to_world(s.normal) : vec3(0.0));
#endif
#ifdef AT_ALBEDO
    write_vector(at + AT_ALBEDO, is_hit ? s.base : vec3(0.0));
#endif
#ifdef AT_NODE
    words[at + AT_NODE] = is_hit ? s.node + 1u : 0u;
#endif
#ifdef AT_MATERIAL
    words[at + AT_MATERIAL] = is_hit ? materials[s.material].source + 1u : 0u;
#endif
#ifdef FOLLOWS_LIST
    list_seen seen = follow_list(pixel, first, end);
    vec3 through = seen.share * exp(-seen.depth), of_media = seen.depth;
#else
    vec3 through = vec3(1.0), of_media = vec3(0.0);
#endif
#ifdef AT_TRANSMITTANCE
    write_vector(at + AT_TRANSMITTANCE, through);
#endif
#ifdef AT_OPTICAL_DEPTH
    vec2 place = vec2(pixel) + u_sample_positions[0];
    write_vector(at + AT_OPTICAL_DEPTH,
                 of_media + depth_of_air(place, opaque) + depth_of_smoke(place, opaque));
#endif
#ifdef AT_LIGHTS
    words[at + AT_LIGHTS] = is_hit ? count_lights(uvec2(pixel), view_z) : 0u;
#endif
#ifdef AT_LAYERS
    uint layers = end - first;
#ifdef HAS_GROUND
    for (uint k = first; k < end; k++)
        layers -= is_ground(keys[u_keys_offset + k]) ? 1u : 0u;
#endif
    words[at + AT_LAYERS] = layers;
#endif
}

// SPDX-License-Identifier: MIT
// The samples of a deep image: of each pixel its layers front to back, what media between them
// take, and the opaque surface or the background. Over one another they are the picture's pixel.
// Needs: SAMPLES (1), HAS_TRANSPARENT, IS_ORTHOGRAPHIC, those of media.glsl.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "base/wide.glsl"
#include "material/material.glsl"
#include "draw/surface.glsl"
#include "window/view_ray.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
#include "window/gbuffer.glsl"
layout(std430, binding = BIND_STATISTICS) writeonly buffer slot_buffer { vec4 slots[]; };
layout(std430, binding = BIND_SCAN) writeonly buffer place_buffer { uvec2 places[]; };
layout(rgba32f, binding = 0) readonly uniform image2D u_opaque; // and the background
uniform uvec2 u_size_px;
uniform vec2 u_sample_positions[SAMPLES]; // in the pixel, y up
#ifdef HAS_TRANSPARENT
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
layout(std430, binding = BIND_ENTRY_KEYS) readonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_COLORS) readonly buffer color_buffer { vec4 colors[]; };
uniform uint u_keys_offset;
#define WALKS 1
#include "material/media.glsl"
#endif
// Slots of an entry: its own, and that of the media before it.
#ifdef HAS_MEDIA
const uint ENTRY_SLOTS = 2u;
#else
const uint ENTRY_SLOTS = 1u;
#endif
uint first_slot = 0u, slot_count = 0u;

void put(float depth, float back, vec3 light, vec3 opacity)
{
    if (light == vec3(0.0) && opacity == vec3(0.0))
        return;
    uint at = 2u * (first_slot + slot_count++);
    slots[at] = vec4(depth, back, light.rg);
    slots[at + 1u] = vec4(light.b, opacity);
}

#ifdef HAS_MEDIA
// What media take from where the walk was, with that optical depth, to where it is.
void put_medium(float from, vec3 tau)
{
    vec3 depth = max(max(wide_round(media_tau[0]), 0.0) - max(tau, 0.0), 0.0);
    put(from, media_at[0], vec3(0.0), 1.0 - exp(-depth));
}
#endif

#ifdef HAS_TRANSPARENT
// As lists_composite.glsl follows them.
void put_layers(ivec2 pixel, uint first, uint end, float depth)
{
#ifdef HAS_MEDIA
    float depths[WALKS] = float[](depth);
    media_begin_list(pixel, depths, first, end);
#endif
    for (uint k = first; k < end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        if ((key.w & 1u) == 0u)
            continue;
        float view_z = view_depth(uintBitsToFloat(key.x));
#ifdef HAS_MEDIA
        medium_event e = media_event(key.z, uintBitsToFloat(key.x));
        float from = media_at[0];
        vec3 tau = wide_round(media_tau[0]);
        media_meet(0, e);
        put_medium(from, tau);
        media_cross(0, e);
        view_z = media_at[0];
        if ((key.w & ENTRY_HIDDEN) != 0u)
            continue;
#endif
        vec4 word = colors[2u * key.z + 1u];
        vec3 opacity = mix(word.rgb, 1.0 + word.rgb, lessThan(word.rgb, vec3(0.0)));
        put(view_z, view_z, colors[2u * key.z].rgb * word.a, opacity);
    }
#ifdef HAS_MEDIA
    float from = media_at[0];
    vec3 tau = wide_round(media_tau[0]);
    media_end(0, depth);
    put_medium(from, tau);
#endif
}
#endif

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, u_size_px)))
        return;
    float depth = texelFetch(u_depth_map, pixel, 0).x;
    uint index = gl_GlobalInvocationID.y * u_size_px.x + gl_GlobalInvocationID.x;
    uint first = 0u;
#ifdef HAS_TRANSPARENT
    first = index == 0u ? 0u : ends[index - 1u];
    first_slot = ENTRY_SLOTS * (first + index);
    put_layers(pixel, first, ends[index], depth);
#else
    first_slot = index;
#endif
    vec4 opaque = imageLoad(u_opaque, pixel);
    opaque = mix(opaque, vec4(0.0), isnan(opaque));
    float at = depth > 0.0 ? view_depth(depth) : uintBitsToFloat(0x7f800000u);
    put(at, at, opaque.rgb, vec3(opaque.a));
    places[index] = uvec2(first_slot, slot_count);
}

// SPDX-License-Identifier: MIT
// Composites the layers of pixels front to back, one at a time; DUAL: and another one back to
// front. A thread per pixel.
//   PASS=0  no layer has been peeled yet
//   PASS=1  adds the layer at hand, which is lit, and goes on to the next; a pixel ends where what
//           all of its samples let through is less than half of what a float tells from nothing
//           beside 1, and with its last layer: where the draws of later layers are cut off, a
//           fragment that is peeled may come with other samples
// Needs: SAMPLES.
#include "shared/bindings.h"
#include "base/wide.glsl"
#include "material/filter_unpack.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_ENTRY_KEYS) buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_COLORS) buffer color_buffer { vec4 colors[]; };
#if PASS == 1
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
#endif
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };
#define PEELED_ACCESS
#include "transparency/peeled_state.glsl"
#define SUMS_ACCESS
#include "transparency/peeled_sums.glsl"
uniform uint u_first;  // pixel of the dispatch
uniform uint u_pixels; // their number
#if PASS == 0
uniform uint u_is_continued; // the light of earlier lights stays
#else
uniform uint u_peeled; // layers of a pixel, with those at hand, where it has as many
#endif
const float SHARE_LEAST = 1.0 / 33554432.0; // 2^-25

void sums_store_side(uint k, wide3 light, wide3 share)
{
    vec3 s = wide_high(share);
    peeled_sums[k] = vec4(wide_high(light), s.x);
    peeled_sums[k + 1u] = vec4(wide_low(light), s.y);
    peeled_sums[k + 2u] = vec4(s.z, wide_low(share));
}

// Nothing is found yet of the next layer.
void begin_layer(uint pixel, uint last_depth, uint last_tie)
{
    LAST_DEPTH(pixel) = last_depth;
    LAST_TIE(pixel) = last_tie;
    NEAREST_DEPTH(pixel) = 0u;
    NEAREST_TIE(pixel) = NO_TIE;
#ifdef DUAL
    FARTHEST_DEPTH(pixel) = 0xffffffffu;
    FARTHEST_TIE(pixel) = 0u;
#endif
    for (uint i = 0u; i < ENTRIES; i++) {
        uint entry = PEELED_ENTRY(pixel) + i;
        keys[entry] = uvec4(0u);
        colors[2u * entry] = colors[2u * entry + 1u] = vec4(0.0); // not to be lit
    }
}

#if PASS == 0
void begin_pixel(uint pixel)
{
    for (int i = 0; i < SAMPLES; i++) {
        wide3 light = wide_of(vec3(0.0)), share;
        if (u_is_continued != 0u)
            sums_load(pixel, i, light, share);
        uint k = sums_place(pixel, i);
        sums_store_side(k, light, share_all());
#ifdef DUAL
        sums_store_side(k + SIDE_VECTORS, wide_of(vec3(0.0)), share_all());
#endif
    }
#ifdef DUAL
    BACK_DEPTH(pixel) = 0u;
    BACK_TIE(pixel) = NO_TIE; // behind all layers
#endif
    begin_layer(pixel, 0xffffffffu, 0u); // before all depths
}
#else
// Behind the layers before it. Returns the most that they and it let through of a sample.
float composite(uint pixel)
{
    uint entry = PEELED_ENTRY(pixel), coverage = keys[entry].w;
    vec4 word = colors[2u * entry + 1u];
    vec3 layer = colors[2u * entry].rgb * word.a;
    wide3 filter_ = filter_unpack(word.rgb);
    vec3 most = vec3(0.0);
    for (int i = 0; i < SAMPLES; i++) {
        wide3 light, share;
        uint k = sums_place(pixel, i);
        sums_load_side(k, light, share);
        if ((coverage & 1u << i) != 0u) {
            light = light_add(light, share, layer);
            share = share_filter(share, filter_);
            sums_store_side(k, light, share);
        }
        most = max(most, share_round(share));
    }
    return max(most.r, max(most.g, most.b));
}

#ifdef DUAL
// The entry of the farthest layer, if it is another one, before the layers that are behind it.
void composite_from_behind(uint pixel)
{
    uint entry = PEELED_ENTRY(pixel) + 1u, coverage = keys[entry].w;
    vec4 word = colors[2u * entry + 1u];
    vec3 layer = colors[2u * entry].rgb * word.a;
    wide3 filter_ = filter_unpack(word.rgb);
    for (int i = 0; i < SAMPLES; i++) {
        if ((coverage & 1u << i) == 0u)
            continue;
        wide3 light, share;
        uint k = sums_place(pixel, i) + SIDE_VECTORS;
        sums_load_side(k, light, share);
        light = wide_add(share_filter(light, filter_), layer);
        sums_store_side(k, light, share_filter(share, filter_));
    }
    BACK_DEPTH(pixel) = FARTHEST_DEPTH(pixel);
    BACK_TIE(pixel) = FARTHEST_TIE(pixel);
}
#endif

void add_layer(uint pixel)
{
    uint depth = NEAREST_DEPTH(pixel), tie = NEAREST_TIE(pixel);
    if (tie == NO_TIE)
        return; // the pixel has no more layers
#ifdef DUAL
    composite_from_behind(pixel);
#endif
    uint count = ends[pixel] - (pixel == 0u ? 0u : ends[pixel - 1u]);
    if (composite(pixel) < SHARE_LEAST || u_peeled >= count) {
        begin_layer(pixel, 0u, NO_TIE); // behind all depths
    } else {
        begin_layer(pixel, depth, tie);
        atomicOr(statistics[STATISTICS_PEELING], 1u);
    }
}
#endif

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_pixels)
        return;
    uint pixel = u_first + i;
#if PASS == 0
    begin_pixel(pixel);
#else
    add_layer(pixel);
#endif
}

// SPDX-License-Identifier: MIT
// Composites the layers of pixels front to back, one at a time. A thread per pixel.
//   PASS=0  no layer has been peeled yet
//   PASS=1  adds the layer at hand, which is lit, and goes on to the next; a pixel ends where what
//           all of its samples let through is less than half of what a float tells from nothing
//           beside 1
// Needs: SAMPLES.
#include "shared/bindings.h"
#include "base/wide.glsl"
#include "material/filter_unpack.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_ENTRY_KEYS) buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_COLORS) buffer color_buffer { vec4 colors[]; };
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };
#define PEELED_ACCESS
#include "transparency/peeled_state.glsl"
#define SUMS_ACCESS
#include "transparency/peeled_sums.glsl"
uniform uint u_pixels;
#if PASS == 0
uniform uint u_is_continued; // the light of earlier lights stays
#endif
const float SHARE_LEAST = 1.0 / 33554432.0; // 2^-25

void sums_store(uint pixel, int sample_, wide3 light, wide3 share)
{
    uint k = sums_place(pixel, sample_);
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
    keys[pixel] = uvec4(0u);
    colors[2u * pixel] = colors[2u * pixel + 1u] = vec4(0.0); // not to be lit
}

#if PASS == 0
void begin_pixel(uint pixel)
{
    for (int i = 0; i < SAMPLES; i++) {
        wide3 light = wide_of(vec3(0.0)), share;
        if (u_is_continued != 0u)
            sums_load(pixel, i, light, share);
        sums_store(pixel, i, light, share_all());
    }
    begin_layer(pixel, 0xffffffffu, 0u); // before all depths
}
#else
// Returns the most that a sample lets through.
float composite(uint pixel, uint coverage)
{
    vec4 word = colors[2u * pixel + 1u];
    vec3 layer = colors[2u * pixel].rgb * word.a;
    wide3 filter_ = filter_unpack(word.rgb);
    vec3 most = vec3(0.0);
    for (int i = 0; i < SAMPLES; i++) {
        wide3 light, share;
        sums_load(pixel, i, light, share);
        if ((coverage & 1u << i) != 0u) {
            light = light_add(light, share, layer);
            share = share_filter(share, filter_);
            sums_store(pixel, i, light, share);
        }
        most = max(most, share_round(share));
    }
    return max(most.r, max(most.g, most.b));
}

void add_layer(uint pixel)
{
    uint depth = NEAREST_DEPTH(pixel), tie = NEAREST_TIE(pixel);
    if (tie == NO_TIE)
        return; // the pixel has no more layers
    if (composite(pixel, keys[pixel].w) < SHARE_LEAST) {
        begin_layer(pixel, 0u, NO_TIE); // behind all depths
    } else {
        begin_layer(pixel, depth, tie);
        atomicOr(statistics[STATISTICS_PEELING], 1u);
    }
}
#endif

void main()
{
    uint pixel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationID.x;
    if (pixel >= u_pixels)
        return;
#if PASS == 0
    begin_pixel(pixel);
#else
    add_layer(pixel);
#endif
}

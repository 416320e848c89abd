// SPDX-License-Identifier: MIT
// Layers upon layers in the arithmetic of wide.glsl: is it right on this device, and how fast?
// (renderer/gl/wide_floats.c)
#include "shared/bindings.h"
#include "base/wide.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = BIND_STATISTICS) writeonly buffer probe_results {
    uvec2 results[]; // share, light, with pairs depth of the first invocation: their bits
};
uniform uint u_layers;
uniform vec2 u_words;     // of a dark layer, which every 16th is, and of the others
uniform vec3 u_way_light; // extinction, way, radiance of a layer
uniform float u_spread;   // 0, which no compiler knows: invocations may differ
#ifdef WIDE_PAIRS
uniform uint u_with_depth;
#endif

uvec2 bits(wide3 a)
{
#ifdef WIDE_PAIRS
    return floatBitsToUint(vec2(a.hi.x, a.lo.x));
#else
    return unpackDouble2x32(a.x);
#endif
}

void main()
{
    vec2 words = u_words + float(gl_LocalInvocationIndex) * u_spread;
    wide3 dark = wide_of(vec3(-words.x)), bright = wide_one_minus(vec3(words.y));
    wide3 share = share_all(), light = wide_of(vec3(0.0));
#ifdef WIDE_PAIRS // where f64 is emulated each operation takes hundreds of instructions
    wide3 tau = wide_of(vec3(0.0)), sigma = wide_of(vec3(u_way_light.x));
#endif
    for (uint i = 0u; i < u_layers; i++) {
        light = light_add(light, share, vec3(u_way_light.z));
        share = share_filter(share, wide_mix(bright, dark, bvec3((i & 15u) == 0u)));
#ifdef WIDE_PAIRS
        if (u_with_depth != 0u)
            tau = depth_add(tau, sigma, wide_product(u_way_light.y, words.y));
#endif
    }
    if (gl_GlobalInvocationID.x != 0u && wide_round(light).x >= 0.0) // the others only work
        return;
    results[0] = bits(share);
    results[1] = bits(light);
#ifdef WIDE_PAIRS
    results[2] = bits(tau);
#endif
}

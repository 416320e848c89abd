// SPDX-License-Identifier: MIT
// Steps of the self-test that need compute: many work groups, barriers, buffer textures,
// visibility between dispatches, and samples against coverage masks.
#include "probes/selftest.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = BIND_SCAN) buffer selftest_values { uint values[]; };
layout(binding = UNIT_SHADOW_EVENTS) uniform samplerBuffer u_texels;
layout(binding = UNIT_GBUFFER_0) uniform usampler2DMS u_samples;
uniform uint u_step, u_items, u_behind; // u_behind: id of the triangle whose masks were noted last

shared uint partial_sums[64];

void write_values(uint i)
{
    if (i < u_items)
        values[i] = i % 97u;
    if (i != 0u)
        return;
    vec3 s = texelFetch(u_texels, 0).xyz + texelFetch(u_texels, 1).xyz;
    texels = floatBitsToUint(s.x + 10.0 * s.y + 100.0 * s.z);
}

void sum_values(uint i)
{
    uint lane = gl_LocalInvocationIndex;
    partial_sums[lane] = i < u_items ? values[u_items - 1u - i] : 0u;
    barrier();
    for (uint half_way = 32u; half_way > 0u; half_way >>= 1) {
        if (lane < half_way)
            partial_sums[lane] += partial_sums[lane + half_way];
        barrier();
    }
    if (lane == 0u)
        atomicAdd(sum, partial_sums[0]);
}

void compare_masks(uint i)
{
    if (i >= u_items)
        return;
    uint mask = 0u;
    for (int s = 0; s < 4; s++)
        if (texelFetch(u_samples, ivec2(i % u_width, i / u_width), s).x == u_behind)
            mask |= 1u << s;
    if (mask != masks[i])
        atomicAdd(mask_errors, 1u);
    if (mask != 0u && mask != 15u)
        atomicAdd(partly, 1u);
}

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (u_step == 0u)
        write_values(i);
    else if (u_step == 1u)
        sum_values(i);
    else
        compare_masks(i);
}

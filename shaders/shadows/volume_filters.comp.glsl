// SPDX-License-Identifier: MIT
// What of a light arrives at each point, by what its way from the eye has gained and what light
// loses on its way to the eye. Needs: those of volume_points.glsl.
#include "shadows/volume_points.glsl"
layout(std430, binding = BIND_VOLUME_STARTS) readonly buffer start_buffer { vec4 starts[]; };
layout(std430, binding = BIND_VOLUME_SUMS) readonly buffer sum_buffer { int sums[]; };
layout(std430, binding = BIND_VOLUME_FILTERS) writeonly buffer filter_buffer { uvec2 filters[]; };
layout(std430, binding = BIND_STATISTICS) readonly buffer counter_buffer { int counters[]; };
#include "shadows/pack_filter.glsl"

// 2^-x for x in units of 2^-20: of the share below 1 by the series of the exponential function,
// whose next term is less than 2^-27.
float power(uint x)
{
    float t = float(x & 0xfffffu) * (-0.69314718056 / 1048576.0), sum = 1.0;
    for (int n = 9; n > 0; n--)
        sum = 1.0 + sum * t / float(n);
    return ldexp(sum, -int(min(x >> 20, 126u)));
}

void main()
{
    uint i;
    if (!volume_point(i) || starts[i].w == 0.0)
        return;
    vec3 t = vec3(0.0);
    for (uint k = 0u; k < 3u; k++)
        if (sums[6u * i + 3u + k] + counters[VOLUME_OF_EYE + 3u + k] == 0)
            t[k] = power(uint(sums[6u * i + k] + counters[VOLUME_OF_EYE + k]));
    filters[table[i].x + uint(starts[i].w) - 1u] = pack_filter(t);
}

// SPDX-License-Identifier: MIT
// What of a light arrives at each point, by what its way from the eye has gained and what light
// loses on its way to the eye. Needs: those of volume_points.glsl; HAS_GROUPS (volume.glsl);
// IS_DRAWN: it is in the pictures of volume_drawn.frag.glsl; IS_PRODUCT: of that.
#include "shadows/volume_points.glsl"
layout(std430, binding = BIND_VOLUME_STARTS) readonly buffer start_buffer { vec4 starts[]; };
layout(std430, binding = BIND_VOLUME_SUMS) readonly buffer sum_buffer { int sums[]; };
layout(std430, binding = BIND_VOLUME_FILTERS) buffer filter_buffer { uvec2 filters[]; };
layout(std430, binding = BIND_STATISTICS) readonly buffer counter_buffer { int counters[]; };
#include "shadows/pack_filter.glsl"
#include "shadows/volume_octaves.glsl"

int sum_of(uint point, uint k)
{
    return sums[6u * point + k] + counters[VOLUME_OF_EYE + k];
}

#ifdef IS_DRAWN
layout(std430, binding = BIND_TRACED_POINTS) readonly buffer point_buffer {
    shadow_point points[];
};
layout(binding = UNIT_VOLUME_SURFACES) uniform sampler2D u_surfaces_map;
layout(binding = UNIT_VOLUME_LAYERS) uniform sampler2D u_layers_map;
uniform uint u_width_px;
uniform uint u_layers; // points of layers, which come first

// What half floats left of it; no number, or more light than there is, counts as all.
vec3 filter_of(uint point, uvec2 before)
{
    uint index = points[point].pixel_roughness & ((1u << SHADOW_POINT_PIXEL_BITS) - 1u);
    ivec2 pixel = ivec2(index % u_width_px, index / u_width_px);
    vec3 way = point < u_layers ? texelFetch(u_layers_map, pixel, 0).rgb
                                : texelFetch(u_surfaces_map, pixel, 0).rgb;
    vec3 t;
    for (uint k = 0u; k < 3u; k++) {
        float eye = volume_octaves(counters[VOLUME_OF_EYE + k], counters[VOLUME_OF_EYE + 3u + k]);
#ifdef IS_PRODUCT
        t[k] = way[k] * exp2(-eye);
#else
        t[k] = exp2(-way[k] - eye);
#endif
        t[k] = t[k] >= 0.0 && t[k] < 1.0 ? t[k] : 1.0;
    }
    return t;
}
#elif defined(HAS_GROUPS)
#include "shadows/traced_filter.glsl"
layout(std430, binding = BIND_VOLUME_GROUPS) readonly buffer group_buffer { vec4 groups[]; };
uniform uint u_first_group;

// By squaring, as no other way is as exact.
vec3 power(vec3 t, uint n)
{
    vec3 product = vec3(1.0);
    for (; n != 0u; n >>= 1) {
        product *= (n & 1u) != 0u ? t : vec3(1.0);
        t *= t;
    }
    return product;
}

vec3 filter_of(uint point, uvec2 before)
{
    vec3 t = u_first_group == 0u ? vec3(1.0) : traced_filter(before);
    for (uint k = 0u; k < 6u; k++)
        t *= power(groups[u_first_group + k].rgb, uint(max(sum_of(point, k), 0)));
    return t;
}
#else
// 2^-x for x in units of 2^-20: of the share below 1 by the series of the exponential function,
// whose next term is less than 2^-27.
float power(uint x)
{
    float t = float(x & 0xfffffu) * (-0.69314718056 / 1048576.0), sum = 1.0;
    for (int n = 9; n > 0; n--)
        sum = 1.0 + sum * t / float(n);
    return ldexp(sum, -int(min(x >> 20, 126u)));
}

vec3 filter_of(uint point, uvec2 before)
{
    vec3 t = vec3(0.0);
    for (uint k = 0u; k < 3u; k++)
        if (sum_of(point, 3u + k) == 0)
            t[k] = power(uint(sum_of(point, k)));
    return t;
}
#endif

void main()
{
    uint i;
    if (!volume_point(i) || starts[i].w == 0.0)
        return;
    uint at = table[i].x + uint(starts[i].w) - 1u;
    filters[at] = pack_filter(filter_of(i, filters[at]));
}

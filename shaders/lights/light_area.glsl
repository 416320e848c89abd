// SPDX-License-Identifier: MIT
// Area lights as points on them: those that the ray tracer takes (renderer/raytrace/rt_emitter.h),
// in the same order: Sobol's first two dimensions, scrambled per pixel and light.
// Provides, where HAS_AREA_SAMPLES:
//   light_area a = light_area_of(light, pixel)  pixel: in the window, row 0 at the bottom
//   light_area_offset(a, i)  from the centre to the i-th of u_area_samples points
#ifdef HAS_AREA_SAMPLES
layout(binding = UNIT_LIGHT_AREAS) uniform samplerBuffer u_light_areas; // struct area_record
uniform uint u_area_samples;                                           // > 1
uniform uint u_area_fixed;   // 1: the points are the same at every pixel, and of every light
uniform uvec2 u_area_origin; // of the window's first column and row in the image, y down

struct light_area {
    vec3 half_u, half_v;
    bool is_disk;
    uint turn; // what the sequence is scrambled by
};

// place: of the pixel in the image.
uint light_area_seed(uint light, uvec2 place)
{
    uint seed = ((place.x * 73856093u) ^ (place.y * 19349663u)) + 1u + light; // rt_job_seed
    return u_area_fixed != 0u ? 1u : seed;
}

// Finaliser of Murmur3 (Appleby 2008).
uint scatter_bits(uint x)
{
    x = (x ^ x >> 16) * 0x85ebca6bu;
    x = (x ^ x >> 13) * 0xc2b2ae35u;
    return x ^ x >> 16;
}

light_area light_area_of(uint light, uvec2 pixel)
{
    vec4 u = texelFetch(u_light_areas, int(2u * light));
    vec4 v = texelFetch(u_light_areas, int(2u * light + 1u));
    uvec2 place = uvec2(u_area_origin.x + pixel.x, u_area_origin.y - pixel.y);
    return light_area(u.xyz, v.xyz, u.w > 0.0,
                      scatter_bits(light_area_seed(light, place) + 0x9e3779b9u));
}

// Direction numbers of the polynomial x + 1 are Pascal's triangle modulo 2: five steps in place of
// a loop over bits.
uint sobol_second(uint index)
{
    uint x = index;
    x ^= x >> 1 & 0x55555555u;
    x ^= x >> 2 & 0x33333333u;
    x ^= x >> 4 & 0x0f0f0f0fu;
    x ^= x >> 8 & 0x00ff00ffu;
    x ^= x >> 16;
    return bitfieldReverse(x);
}

// Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square".
vec2 square_to_disk(vec2 p)
{
    bool is_wide = abs(p.x) > abs(p.y);
    float radius = is_wide ? p.x : p.y, other = is_wide ? p.y : p.x;
    float share = radius != 0.0 ? other / radius : 0.0;
    float angle = 0.78539816 * (is_wide ? share : 2.0 - share);
    return radius * vec2(cos(angle), sin(angle));
}

vec3 light_area_offset(light_area a, uint i)
{
    uvec2 bits = uvec2(bitfieldReverse(i), sobol_second(i)) ^ uvec2(a.turn, scatter_bits(a.turn));
    vec2 place = 2.0 * ((vec2(bits >> 8) + 0.5) * (1.0 / 16777216.0)) - 1.0;
    if (a.is_disk)
        place = square_to_disk(place);
    return a.half_u * place.x + a.half_v * place.y;
}
#endif

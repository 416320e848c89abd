// SPDX-License-Identifier: MIT
// A transmittance that rays have found on the CPU, in two words
// (renderer/raytrace/rt_shadow_rays.h).
vec3 traced_filter(uvec2 w)
{
    const int bits = TRACED_FILTER_BITS;
    uvec3 m = uvec3(w.x, w.x >> bits | w.y << (32 - bits), w.y >> (2 * bits - 32));
    uint e = w.y >> (3 * bits - 32);
    float unit = uintBitsToFloat((128u - uint(bits) - e) << 23); // 2^(1 - e) over 2^bits
    return vec3(m & ((1u << bits) - 1u)) * unit;
}

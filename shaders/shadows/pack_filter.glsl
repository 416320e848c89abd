// SPDX-License-Identifier: MIT
// A transmittance in two words, as traced_filter.glsl reads them; the same as rt_shadow_pack of
// renderer/raytrace/rt_shadow_rays.h gives.
uvec2 pack_filter(vec3 t)
{
    const int bits = TRACED_FILTER_BITS;
    float largest = max(t.r, max(t.g, t.b));
    if (!(largest > 0.0))
        return uvec2(0u);
    int exponent = int(floatBitsToUint(largest) >> 23) - 126; // largest < 2^exponent
    exponent = max(exponent, 1 - TRACED_EXPONENT_MAX);
    uvec3 m = uvec3(ldexp(t, ivec3(bits - exponent)) + 0.5);
    if (max(m.r, max(m.g, m.b)) >> bits != 0u) { // rounded up to the next power of two
        exponent++;
        m = uvec3(ldexp(t, ivec3(bits - exponent)) + 0.5);
    }
    return uvec2(m.r | m.g << bits, m.g >> (32 - bits) | m.b << (2 * bits - 32) |
                                        uint(1 - exponent) << (3 * bits - 32));
}

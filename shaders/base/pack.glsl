// SPDX-License-Identifier: MIT
// Packing of directions, colours and small factors into 32-bit words.

// Octahedral map. Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit
// Vectors", section 3 (oct32): worst error 0.00075 degrees.
vec2 oct_wrap(vec2 v)
{
    return (1.0 - abs(v.yx)) * vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
}

uint pack_unit(vec3 n)
{
    vec2 p = n.xy / max(abs(n.x) + abs(n.y) + abs(n.z), 1e-30);
    return packSnorm2x16(n.z >= 0.0 ? p : oct_wrap(p));
}

vec3 unpack_unit(uint word)
{
    vec2 p = unpackSnorm2x16(word);
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0)
        n.xy = oct_wrap(n.xy);
    return normalize(n);
}

// A factor in [0,1] in 16 bits, and a pair of any magnitude with a shared exponent: each within
// 2^-19 of the larger one.
uvec2 pack_factor_and_pair(float factor, vec2 v)
{
    int exponent;
    frexp(max(abs(v.x), abs(v.y)), exponent);
    exponent = clamp(exponent, -100, 100);
    uvec2 m = uvec2(ivec2(round(clamp(v * exp2(float(19 - exponent)), -524287.0, 524287.0))));
    return uvec2(packUnorm2x16(vec2(factor, 0.0)) | m.x << 16,
                 (m.x >> 16 & 0xfu) | (m.y & 0xfffffu) << 4 | uint(exponent + 128) << 24);
}

float unpack_factor(uvec2 words)
{
    return unpackUnorm2x16(words.x).x;
}

vec2 unpack_pair(uvec2 words)
{
    int x = int(words.x >> 16 | words.y << 16), y = int(words.y >> 4);
    vec2 m = vec2(bitfieldExtract(x, 0, 20), bitfieldExtract(y, 0, 20));
    return m * exp2(float(int(words.y >> 24) - 128 - 19));
}

// Shared-exponent radiance, three 9-bit mantissas (EXT_texture_shared_exponent): relative error
// 2^-9.
uint pack_radiance(vec3 c)
{
    c = clamp(c, 0.0, 65408.0);
    float largest = max(c.r, max(c.g, c.b));
    int exponent = max(-16, int(floor(log2(max(largest, 1e-30))))) + 16;
    float scale = exp2(float(24 - exponent));
    if (largest * scale + 0.5 >= 512.0) {
        scale *= 0.5;
        exponent += 1;
    }
    uvec3 m = uvec3(c * scale + 0.5);
    return min(m.r, 511u) | min(m.g, 511u) << 9 | min(m.b, 511u) << 18 | uint(exponent) << 27;
}

vec3 unpack_radiance(uint word)
{
    float scale = exp2(float(int(word >> 27) - 24));
    return vec3(uvec3(word, word >> 9, word >> 18) & 511u) * scale;
}

// SPDX-License-Identifier: MIT
// A shaded point's surface, as it travels from the geometry passes to the shading passes: two words
// of four.
#include "base/pack.glsl"

struct surface {
    vec3 normal;         // shading normal, unit, view space, on the viewer's side
    vec3 geo_normal;     // of the triangle, unit, on the viewer's side
    vec3 base;           // linear base colour after textures
    float alpha;         // coverage of BLEND surfaces, else 1
    float metallic, roughness, occlusion;
    vec3 emissive;       // nt
    uint node, material;
    bool is_front;       // the viewer sees the front face
};

uvec4 surface_pack_0(surface s)
{
    return uvec4(pack_unit(s.normal), pack_unit(s.geo_normal), packUnorm2x16(s.base.rg),
                 packUnorm2x16(vec2(s.base.b, s.roughness)));
}

uvec4 surface_pack_1(surface s)
{
    uvec2 small = uvec2(vec2(s.metallic, s.occlusion) * 255.0 + 0.5);
    uint alpha = uint(s.alpha * 65535.0 + 0.5);
    return uvec4(pack_radiance(s.emissive), small.x | small.y << 8 | alpha << 16,
                 s.node | (s.is_front ? 0x80000000u : 0u), s.material);
}

// Equal for samples of one smooth surface: node, material, and the coarse direction of the
// triangle. One word, because comparing the samples of every pixel is what multisampled shading
// spends its time on.
uint surface_signature(surface s)
{
    uvec3 coarse = uvec3(s.geo_normal * 3.49 + 4.0);
    return coarse.x | coarse.y << 3 | coarse.z << 6 | (s.node & 0x1fffu) << 9 | s.material << 22;
}

// Whether these may be of one surface that curves: node and material are the same, the coarse
// directions neighbours.
bool signatures_are_near(uint a, uint b)
{
    uvec3 shift = uvec3(0u, 3u, 6u);
    ivec3 step_ = ivec3(uvec3(a) >> shift & 7u) - ivec3(uvec3(b) >> shift & 7u);
    return a >> 9 == b >> 9 && all(lessThanEqual(abs(step_), ivec3(1)));
}

// Opaque surfaces have in the place of alpha how far a point may lie below the curved surface that
// its triangle stands for, over its distance from the eye: a float's upper half. 1 of alpha: none.
const float SURFACE_NORMAL_OFFSET_LEAST = 1e-5; // smaller ones are the rounding of flat triangles
const float SURFACE_NORMAL_OFFSET_MOST = 1e3;   // so that points stay finite

uint surface_pack_normal_offset(uint word, float offset)
{
    uint bits = floatBitsToUint(min(offset, SURFACE_NORMAL_OFFSET_MOST));
    return offset > SURFACE_NORMAL_OFFSET_LEAST ? bitfieldInsert(word, bits >> 16, 16, 16) : word;
}

float surface_normal_offset(uvec4 b)
{
    uint bits = b.y & 0xffff0000u;
    return bits == 0xffff0000u ? 0.0 : uintBitsToFloat(bits);
}

surface surface_unpack(uvec4 a, uvec4 b)
{
    surface s;
    s.normal = unpack_unit(a.x);
    s.geo_normal = unpack_unit(a.y);
    vec2 w = unpackUnorm2x16(a.w);
    s.base = vec3(unpackUnorm2x16(a.z), w.x);
    s.roughness = w.y;
    s.emissive = unpack_radiance(b.x);
    s.metallic = float(b.y & 255u) / 255.0;
    s.occlusion = float(b.y >> 8 & 255u) / 255.0;
    s.alpha = float(b.y >> 16) / 65535.0;
    s.node = b.z & 0x7fffffffu;
    s.is_front = (b.z & 0x80000000u) != 0u;
    s.material = b.w;
    return s;
}

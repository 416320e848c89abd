// SPDX-License-Identifier: MIT
// What a material with MATERIAL_LOBES adds to a surface, as it travels from the geometry passes to
// the shading passes: a word of four, and where materials have MATERIAL_MORE_LOBES another one.
#include "base/pack.glsl"

struct surface_lobes {
    vec4 specular; // of the dielectric: tint of f0; weight of its reflection
    vec3 sheen;    // colour
    float sheen_roughness;
    float coat, coat_roughness;
    vec3 coat_normal; // unit, view space, on the viewer's side
#ifdef HAS_MORE_LOBES
    vec2 film;  // weight; thickness [nm]
    vec4 grain; // unit, view space; strength, 0 where there is none
    vec4 translucent; // colour and share of what is diffused from behind
#endif
};

uvec4 lobes_pack(surface_lobes lobes)
{
    uint coat = uint(lobes.coat_roughness * 65535.0 + 0.5);
    uvec2 small = uvec2(clamp(vec2(lobes.coat, lobes.specular.w), 0.0, 1.0) * 255.0 + 0.5);
    return uvec4(pack_unit(lobes.coat_normal), coat | small.x << 16 | small.y << 24,
                 packUnorm4x8(vec4(lobes.sheen, lobes.sheen_roughness)),
                 pack_radiance(lobes.specular.rgb));
}

surface_lobes lobes_unpack(uvec4 words)
{
    surface_lobes lobes;
    vec4 fibres = unpackUnorm4x8(words.z);
    lobes.coat_normal = unpack_unit(words.x);
    lobes.coat_roughness = float(words.y & 65535u) / 65535.0;
    lobes.coat = float(words.y >> 16 & 255u) / 255.0;
    lobes.specular = vec4(unpack_radiance(words.w), float(words.y >> 24) / 255.0);
    lobes.sheen = fibres.rgb;
    lobes.sheen_roughness = fibres.a;
    return lobes;
}

#ifdef HAS_MORE_LOBES
// Of a float that is not negative the upper 24 bits below the sign: a thickness within 2^-16.
uvec4 more_lobes_pack(surface_lobes lobes)
{
    uint weight = uint(clamp(lobes.film.x, 0.0, 1.0) * 255.0 + 0.5);
    uint thickness = floatBitsToUint(max(lobes.film.y, 0.0)) + 64u >> 7;
    uint strength = uint(clamp(lobes.grain.w, 0.0, 1.0) * 255.0 + 0.5);
    vec3 along = lobes.grain.w > 0.0 ? lobes.grain.xyz : vec3(0.0, 0.0, 1.0);
    return uvec4(weight << 24 | thickness & 0xffffffu, pack_unit(along), strength << 24,
                 packUnorm4x8(lobes.translucent));
}

void more_lobes_unpack(uvec4 words, inout surface_lobes lobes)
{
    lobes.film = vec2(float(words.x >> 24) / 255.0, uintBitsToFloat((words.x & 0xffffffu) << 7));
    lobes.grain = vec4(unpack_unit(words.y), float(words.z >> 24) / 255.0);
    lobes.translucent = unpackUnorm4x8(words.w);
}
#endif

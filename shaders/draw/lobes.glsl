// SPDX-License-Identifier: MIT
// What a material with MATERIAL_LOBES adds to a surface, as it travels from the geometry passes to
// the shading passes: a word of four.
#include "base/pack.glsl"

struct surface_lobes {
    vec4 specular; // of the dielectric: tint of f0; weight of its reflection
    vec3 sheen;    // colour
    float sheen_roughness;
    float coat, coat_roughness;
    vec3 coat_normal; // unit, view space, on the viewer's side
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

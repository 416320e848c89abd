// SPDX-License-Identifier: MIT
// Material records, texture access, and the transmission filter of a surface, as
// docs/explanation/shading.md has it. Needs: shared/records.h included; v_texcoord_0, v_texcoord_1,
// v_color varyings when the material asks for them.
// TEXTURES is the bit mask of slots that the program samples: absent slots leave no sampler behind.
layout(std430, binding = BIND_MATERIALS) readonly buffer material_buffer {
    material_record materials[];
};

// MATERIAL_KINDS: the MATERIAL_* that the program's materials may have, a constant. A test of
// another is false when the program is compiled and leaves nothing behind. Absent: any.
#ifndef MATERIAL_KINDS
#define MATERIAL_KINDS 0xffffffffu
#endif
#define MATERIAL_MAY_BE(kind) ((MATERIAL_KINDS & (kind)) != 0u)
#define MATERIAL_IS(flags, kind) (MATERIAL_MAY_BE(kind) && ((flags) & (kind)) != 0u)

#ifndef TEXTURES
#define TEXTURES 0
#endif
#if TEXTURES != 0
layout(binding = UNIT_MATERIAL_0) uniform sampler2D
#if TEXTURES > 16383
    u_textures[21];
#elif TEXTURES > 127
    u_textures[14];
#else
    u_textures[7]; // fewer units, which casters use for other things
#endif
#endif

#if TEXTURES != 0 || defined HAS_GRAIN
struct material_uv {
    vec2 at, dx, dy; // texture coordinates and their screen derivatives
};

// Derivatives are taken of the varyings and transformed afterwards: on llvmpipe a storage buffer
// reads as zero in the helper lanes of a quad, which would spoil any derivative of a value that
// depends on the material record.
// m: the record that has the slot, which is that of its lobes from SLOTS_OF_BASE on, and the next
// one from 2 * SLOTS_OF_BASE on.
material_uv material_coordinates(uint m, int slot, vec2 uv_0, vec2 uv_1)
{
    vec2 dx_0 = dFdx(uv_0), dy_0 = dFdy(uv_0), dx_1 = dFdx(uv_1), dy_1 = dFdy(uv_1);
    int row = slot % SLOTS_OF_BASE;
    bool second = (materials[m].texcoord_mask & (1u << row)) != 0u;
    vec3 uv = vec3(second ? uv_1 : uv_0, 1.0);
    vec2 dx = second ? dx_1 : dx_0, dy = second ? dy_1 : dy_0;
    vec3 row_0 = materials[m].uv_transforms[2 * row].xyz;
    vec3 row_1 = materials[m].uv_transforms[2 * row + 1].xyz;
    return material_uv(vec2(dot(row_0, uv), dot(row_1, uv)),
                       vec2(dot(row_0.xy, dx), dot(row_1.xy, dx)),
                       vec2(dot(row_0.xy, dy), dot(row_1.xy, dy)));
}
#endif

#define SLOT_BASE_COLOR 0
#define SLOT_METALLIC_ROUGHNESS 1
#define SLOT_NORMAL 2
#define SLOT_OCCLUSION 3
#define SLOT_EMISSIVE 4
#define SLOT_TRANSMISSION 5
#define SLOT_THICKNESS 6
#define SLOT_SPECULAR 7
#define SLOT_SPECULAR_COLOR 8
#define SLOT_CLEARCOAT 9
#define SLOT_CLEARCOAT_ROUGHNESS 10
#define SLOT_CLEARCOAT_NORMAL 11
#define SLOT_SHEEN_COLOR 12
#define SLOT_SHEEN_ROUGHNESS 13
#define SLOT_IRIDESCENCE 14
#define SLOT_IRIDESCENCE_THICKNESS 15
#define SLOT_ANISOTROPY 16
#define SLOT_DIFFUSE_TRANSMISSION 17
#define SLOT_DIFFUSE_TRANSMISSION_COLOR 18

vec4 material_texel(uint m, int slot, vec2 uv_0, vec2 uv_1, vec4 otherwise)
{
#if TEXTURES != 0
    if ((TEXTURES & (1 << slot)) != 0)
    {
        material_uv uv = material_coordinates(m, slot, uv_0, uv_1);
        return textureGrad(u_textures[slot], uv.at, uv.dx, uv.dy);
    }
#endif
    return otherwise;
}

#define BLEND_TINT 0
#define BLEND_COVERAGE 1
#define BLEND_KIM 2
#define BLEND_MODISETT 3

// t^power; near 1 by the series of ln(1 + x), because f32's log has no digits left there and
// grazing light raises to powers of up to a million. 0 stays 0.
vec3 filter_power(vec3 t, float power)
{
    vec3 x = t - 1.0;
    vec3 series = x * (1.0 + x * (-0.5 + x * (1.0 / 3.0 + x * (-0.25 + x * 0.2))));
    vec3 ln = mix(log(max(t, 1e-37)), series, greaterThan(t, vec3(0.9375)));
    return mix(exp(ln * power), vec3(0.0), lessThanEqual(t, vec3(0.0)));
}

// Transmittance of one crossing of the surface by light, per channel in [0,1].
// base: base colour and alpha after textures; transmission: factor times texture; thickness_m:
// factor times texture; n_dot_l: |cosine| between light and normal; enters: the ray goes into the
// front face.
vec3 material_filter(uint m, vec4 base, float transmission, float thickness_m, float n_dot_l,
                     bool enters, uint blend_filter)
{
    material_record r = materials[m];
    vec3 t = vec3(0.0);
    if (MATERIAL_IS(r.flags, MATERIAL_TRANSMISSION)) {
        t = transmission * base.rgb;
        if (thickness_m > 0.0 && enters)
            t *= exp(-r.attenuation.rgb * thickness_m);
    }
    if (MATERIAL_IS(r.flags, MATERIAL_BLEND)) {
        float a = base.a;
        if (MATERIAL_IS(r.flags, MATERIAL_TRANSMISSION))
            t = 1.0 - a * (1.0 - t);
        else if (blend_filter == BLEND_TINT)
            t = (1.0 - a) * (1.0 - a * (1.0 - base.rgb));
        else if (blend_filter == BLEND_COVERAGE)
            t = vec3(1.0 - a);
        else
            t = (1.0 - a) * (blend_filter == BLEND_KIM ? 1.0 : 0.5) * base.rgb;
    }
    float c = clamp(n_dot_l, 1e-6, 1.0);
    if (MATERIAL_IS(r.flags, MATERIAL_PASS_SLAB))
        t = filter_power(t, 1.0 / c);
    else if (MATERIAL_IS(r.flags, MATERIAL_PASS_EDGE))
        t = mix(r.edge_color.rgb * t, t, pow(c, r.transmission_f0_thickness.w));
    return clamp(t, 0.0, 1.0);
}

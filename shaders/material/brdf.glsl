// SPDX-License-Identifier: MIT
// Reflection and thin transmission of a punctual light. glTF 2.0 specification, appendix B.3
// (Khronos 2021):
// f = mix of metal and dielectric, both with the GGX microfacet lobe; Fresnel after Schlick 1994
// eq. 15; D and V after Walter et al. 2007 and Heitz 2014 (separable form of B.3.2 in its
// height-correlated shape).
// Above these lie the fibres of KHR_materials_sheen, and above all the coat of
// KHR_materials_clearcoat; KHR_materials_specular changes the dielectric's reflection.
// n, v, l: unit vectors; roughness is perceptual, alpha = roughness^2.
#include "material/fresnel.glsl"
const float PI = 3.14159265358979;
const float MIN_ALPHA = 1e-3; // keeps the lobe of a perfect mirror finite for punctual lights

// The squares of the sine and the cosine between n and h: 1 - cosine^2 would leave nothing of the
// sine in f32 where a smooth surface is brightest.
float ggx_d(vec3 n, vec3 h, float alpha)
{
    float a2 = alpha * alpha, n_dot_h = clamp(dot(n, h), 0.0, 1.0);
    vec3 across = cross(n, h);
    float f = n_dot_h * n_dot_h * a2 + (n_dot_h > 0.0 ? dot(across, across) : 1.0);
    return a2 / max(PI * f * f, 1e-20);
}

float ggx_v(float n_dot_l, float n_dot_v, float alpha)
{
    float a2 = alpha * alpha;
    float l = n_dot_v * sqrt(n_dot_l * n_dot_l * (1.0 - a2) + a2);
    float v = n_dot_l * sqrt(n_dot_v * n_dot_v * (1.0 - a2) + a2);
    return 0.5 / max(l + v, 1e-10);
}

#include "material/sheen.glsl"
#include "material/clearcoat.glsl"
#ifdef HAS_MORE_LOBES
#include "material/film.glsl"
#include "material/grain.glsl"
#endif

struct brdf_input {
    vec3 normal, view;
    vec3 base;
    float metallic, alpha, f0, transmission;
    vec4 specular; // of the dielectric: tint of f0, weight; where MATERIAL_SPECULAR
    vec3 sheen;    // colour; where MATERIAL_SHEEN
    float sheen_roughness;
    vec3 coat_normal;
    float coat_alpha; // where MATERIAL_CLEARCOAT
    float below_sheen, below_coat; // shares of the light of what lies below that come through
#ifdef HAS_MORE_LOBES
    vec3 film;  // weight, index of refraction, thickness [nm]; weight 0 without MATERIAL_FILM
    vec4 translucent; // colour, share; 0 without MATERIAL_TRANSLUCENT
    vec4 grain; // across the normal, unit; roughness squared along it, 0 without MATERIAL_GRAIN
#endif
};

// Distribution times visibility of the base, for a light on the normal's side.
float brdf_lobe(brdf_input b, vec3 h, vec3 l, float n_dot_l, float n_dot_v)
{
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_GRAIN) && b.grain.w > 0.0)
        return grain_lobe(b.normal, b.grain.xyz, cross(b.normal, b.grain.xyz), h, l, b.view,
                          vec2(b.grain.w, b.alpha), n_dot_l, n_dot_v);
#endif
    return ggx_d(b.normal, h, b.alpha) * ggx_v(n_dot_l, n_dot_v, b.alpha);
}

#ifdef HAS_MORE_LOBES
// What the film makes of a reflection whose f0 in air is that; weight: of the dielectric's.
vec3 film_over(brdf_input b, vec3 reflected, vec3 f0, float weight, float cosine)
{
    return mix(reflected, weight * film_fresnel(f0, b.film.y, b.film.z, cosine), b.film.x);
}
#endif

// Reflectance of the dielectric's interface by channel, where there are lobes.
vec3 brdf_interface(brdf_input b, float cosine)
{
    vec4 specular = MATERIAL_MAY_BE(MATERIAL_SPECULAR) ? b.specular : vec4(1.0);
    vec3 reflected = specular_fresnel(b.f0, specular, cosine);
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_FILM) && b.film.x > 0.0)
        reflected = film_over(b, reflected, min(b.f0 * specular.rgb, vec3(1.0)), specular.w,
                              cosine);
#endif
    return reflected;
}

// Diffuse part and lobe of the dielectric. The largest channel of a tinted reflection is what the
// diffuse part loses.
vec3 brdf_dielectric(brdf_input b, vec3 diffuse, float lobe, float cosine)
{
    if (!MATERIAL_MAY_BE(MATERIAL_SPECULAR | MATERIAL_FILM))
        return mix(diffuse, vec3(lobe), dielectric_fresnel(b.f0, cosine));
    vec3 reflected = brdf_interface(b, cosine);
    return diffuse * (1.0 - largest_of(reflected)) + lobe * reflected;
}

// What the dielectric does not let through.
float brdf_fresnel(brdf_input b, float cosine)
{
    if (!MATERIAL_MAY_BE(MATERIAL_SPECULAR | MATERIAL_FILM))
        return dielectric_fresnel(b.f0, cosine);
    return largest_of(brdf_interface(b, cosine));
}

// Whether light from behind is sent on: through the surface, or diffused by it.
bool brdf_passes(brdf_input b)
{
    bool passes = b.transmission > 0.0;
#ifdef HAS_MORE_LOBES
    passes = passes || MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT) && b.translucent.w > 0.0;
#endif
    return passes && b.metallic < 1.0;
}

// f * cosine of the base for light arriving from direction l.
vec3 brdf_evaluate_base(brdf_input b, vec3 l)
{
    float n_dot_v = max(dot(b.normal, b.view), 1e-4);
    float n_dot_l = dot(b.normal, l);
    vec3 result = vec3(0.0);
    if (n_dot_l > 0.0) {
        vec3 h = normalize(l + b.view);
        float lobe = brdf_lobe(b, h, l, n_dot_l, n_dot_v);
        float w = schlick_weight(dot(b.view, h));
        vec3 diffuse = b.base * ((1.0 - b.transmission) / PI);
#ifdef HAS_MORE_LOBES
        if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT))
            diffuse *= 1.0 - b.translucent.w;
#endif
        vec3 dielectric = brdf_dielectric(b, diffuse, lobe, dot(b.view, h));
        vec3 metal = b.base + (1.0 - b.base) * w;
#ifdef HAS_MORE_LOBES
        if (MATERIAL_MAY_BE(MATERIAL_FILM) && b.film.x > 0.0 && b.metallic > 0.0)
            metal = film_over(b, metal, b.base, 1.0, dot(b.view, h));
#endif
        metal *= lobe;
        result = mix(dielectric, metal, b.metallic) * n_dot_l;
    } else if (brdf_passes(b)) {
        // KHR_materials_transmission: the reflection lobe, mirrored to the other side of the thin
        // surface
        vec3 mirrored = normalize(l - 2.0 * n_dot_l * b.normal);
        vec3 h = normalize(mirrored + b.view);
        float cosine = -n_dot_l;
        float lobe = brdf_lobe(b, h, mirrored, max(cosine, 1e-4), n_dot_v);
        float fresnel = brdf_fresnel(b, dot(b.view, h));
        result = b.base * (b.transmission * (1.0 - fresnel) * (1.0 - b.metallic) * lobe * cosine);
#ifdef HAS_MORE_LOBES
        if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT))
            result += b.translucent.rgb *
                      (b.translucent.w * (1.0 - b.transmission) * (1.0 - fresnel) *
                       (1.0 - b.metallic) * cosine / PI);
#endif
    }
    return result;
}

// f * cosine for light arriving from direction l.
vec3 brdf_evaluate(brdf_input b, vec3 l)
{
    vec3 result = brdf_evaluate_base(b, l);
    float n_dot_l = dot(b.normal, l);
    if (MATERIAL_MAY_BE(MATERIAL_SHEEN | MATERIAL_CLEARCOAT)) {
        float n_dot_v = max(dot(b.normal, b.view), 1e-4);
        vec3 h = normalize(l + b.view);
        result *= b.below_sheen;
        if (MATERIAL_MAY_BE(MATERIAL_SHEEN) && n_dot_l > 0.0)
            result += b.sheen *
                      (sheen_lobe(b.normal, h, n_dot_l, n_dot_v, b.sheen_roughness) * n_dot_l);
        result *= b.below_coat;
        float coat_l = dot(b.coat_normal, l), coat_v = max(dot(b.coat_normal, b.view), 1e-4);
        if (MATERIAL_MAY_BE(MATERIAL_CLEARCOAT) && n_dot_l > 0.0 && coat_l > 0.0)
            result += (1.0 - b.below_coat) * ggx_d(b.coat_normal, h, b.coat_alpha) *
                      ggx_v(coat_l, coat_v, b.coat_alpha) * coat_l;
    }
    return result;
}

// Split-sum environment term without a table. Karis 2014, "Physically Based Shading on Mobile".
vec2 environment_brdf(float roughness, float n_dot_v)
{
    const vec4 c0 = vec4(-1.0, -0.0275, -0.572, 0.022), c1 = vec4(1.0, 0.0425, 1.04, -0.04);
    vec4 r = roughness * c0 + c1;
    float a = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    return vec2(-1.04, 1.04) * a + r.zw;
}

// SPDX-License-Identifier: MIT
// Reflection and thin transmission of a punctual light. glTF 2.0 specification, appendix B.3
// (Khronos 2021):
// f = mix of metal and dielectric, both with the GGX microfacet lobe; Fresnel after Schlick 1994
// eq. 15; D and V after Walter et al. 2007 and Heitz 2014 (separable form of B.3.2 in its
// height-correlated shape).
// Above these lie the fibres of KHR_materials_sheen, and above all the coat of
// KHR_materials_clearcoat; KHR_materials_specular changes the dielectric's reflection.
// n, v, l: unit vectors; roughness is perceptual, alpha = roughness^2.
// Needs: brdf_input.glsl; where HAS_LOBES, lobes_take_base and lobes_take_cover of it, which bring
// the parts of brdf_input that are next.
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

// Reflectances at a cosine, by channel: of the dielectric's interface, and of the metal.
struct brdf_mirrors {
    vec3 dielectric, metal;
};

#ifdef HAS_MORE_LOBES
// With the film over both. One after the other in a loop where registers are scarce: side by side
// they would take twice as many.
void brdf_add_film(brdf_input b, vec4 specular, float cosine, inout brdf_mirrors mirrors)
{
    bool has_metal = MATERIAL_MAY_BE(MATERIAL_KIND_METAL) && b.metallic > 0.0;
    vec3 f0 = min(b.f0 * specular.rgb, vec3(1.0));
#ifdef SAMPLES_IN_TURN
    for (int i = has_metal ? 0 : 1; i < 2; i++) {
        bool is_metal = i == 0;
        vec3 film = film_fresnel(is_metal ? b.base : f0, b.film.y, b.film.z, cosine);
        if (is_metal)
            mirrors.metal = mix(mirrors.metal, film, b.film.x);
        else
            mirrors.dielectric = mix(mirrors.dielectric, specular.w * film, b.film.x);
    }
#else
    vec3 film = specular.w * film_fresnel(f0, b.film.y, b.film.z, cosine);
    mirrors.dielectric = mix(mirrors.dielectric, film, b.film.x);
    if (has_metal) {
        film = film_fresnel(b.base, b.film.y, b.film.z, cosine);
        mirrors.metal = mix(mirrors.metal, film, b.film.x);
    }
#endif
}
#endif

brdf_mirrors brdf_mirrors_at(brdf_input b, float cosine)
{
    brdf_mirrors mirrors;
    vec4 specular = MATERIAL_MAY_BE(MATERIAL_SPECULAR) ? b.specular : vec4(1.0);
    mirrors.metal = b.base + (1.0 - b.base) * schlick_weight(cosine);
    if (MATERIAL_MAY_BE(MATERIAL_SPECULAR | MATERIAL_FILM))
        mirrors.dielectric = specular_fresnel(b.f0, specular, cosine);
    else
        mirrors.dielectric = vec3(dielectric_fresnel(b.f0, cosine));
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_FILM) && b.film.x > 0.0)
        brdf_add_film(b, specular, cosine, mirrors);
#endif
    return mirrors;
}

// What the dielectric does not let through. The largest channel of a tinted reflection is what the
// diffuse part loses.
float brdf_fresnel(brdf_mirrors mirrors)
{
    return largest_of(mirrors.dielectric);
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

// Of light on the normal's side: the diffuse part and the lobe.
vec3 brdf_reflected(brdf_input b, brdf_mirrors mirrors, float lobe)
{
    vec3 diffuse = b.base * ((1.0 - b.transmission) / PI);
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT))
        diffuse *= 1.0 - b.translucent.w;
#endif
    vec3 dielectric = mix(diffuse, vec3(lobe), mirrors.dielectric.x);
    if (MATERIAL_MAY_BE(MATERIAL_SPECULAR | MATERIAL_FILM))
        dielectric = diffuse * (1.0 - brdf_fresnel(mirrors)) + lobe * mirrors.dielectric;
    return mix(dielectric, mirrors.metal * lobe, b.metallic);
}

// Of light from behind, whose cosine is that: the lobe, and what is diffused.
vec3 brdf_passed(brdf_input b, brdf_mirrors mirrors, float lobe, float cosine)
{
    float fresnel = brdf_fresnel(mirrors);
    vec3 passed =
        b.base * (b.transmission * (1.0 - fresnel) * (1.0 - b.metallic) * lobe * cosine);
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT))
        passed += b.translucent.rgb *
                  (b.translucent.w * (1.0 - b.transmission) * (1.0 - fresnel) *
                   (1.0 - b.metallic) * cosine / PI);
#endif
    return passed;
}

// f * cosine of the base for light arriving from direction l. Light from behind meets the lobe of
// reflection, mirrored to the other side of the thin surface (KHR_materials_transmission).
vec3 brdf_evaluate_base(brdf_input b, vec3 l)
{
    float n_dot_v = max(dot(b.normal, b.view), 1e-4);
    float n_dot_l = dot(b.normal, l), cosine = -n_dot_l;
    bool is_before = n_dot_l > 0.0;
    vec3 result = vec3(0.0);
    if (is_before || brdf_passes(b)) {
        if (!is_before)
            l = normalize(l - 2.0 * n_dot_l * b.normal);
        vec3 h = normalize(l + b.view);
        float lobe = brdf_lobe(b, h, l, is_before ? n_dot_l : max(cosine, 1e-4), n_dot_v);
        brdf_mirrors mirrors = brdf_mirrors_at(b, dot(b.view, h));
        if (is_before)
            result = brdf_reflected(b, mirrors, lobe) * n_dot_l;
        else
            result = brdf_passed(b, mirrors, lobe, cosine);
    }
    return result;
}

// f * cosine for light arriving from direction l.
vec3 brdf_evaluate(brdf_input b, vec3 l)
{
#ifdef HAS_LOBES
    lobes_take_base(b);
#endif
    vec3 result = brdf_evaluate_base(b, l);
#ifdef HAS_LOBES
    lobes_take_cover(b);
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
#endif
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

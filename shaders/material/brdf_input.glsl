// SPDX-License-Identifier: MIT
// What brdf.glsl asks of a surface.
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

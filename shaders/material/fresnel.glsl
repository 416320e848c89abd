// SPDX-License-Identifier: MIT
// Reflection at an interface. Schlick 1994, "An Inexpensive BRDF Model for Physically-based
// Rendering", eq. 15.
float schlick_weight(float cosine)
{
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    float m2 = m * m;
    return m2 * m2 * m;
}

// At grazing angles a dielectric reflects all, but less for an index of refraction below water's
// (f0 = 0.02); ior 1 is no interface at all.
float dielectric_grazing(float f0)
{
    return min(50.0 * f0, 1.0);
}

// Fresnel term of a dielectric.
float dielectric_fresnel(float f0, float cosine)
{
    float f90 = dielectric_grazing(f0);
    return f0 + (f90 - f0) * schlick_weight(cosine);
}

// The same where KHR_materials_specular tints f0 (specular.rgb) and weighs all (w).
vec3 specular_fresnel(float f0, vec4 specular, float cosine)
{
    vec3 tinted = min(f0 * specular.rgb, vec3(1.0));
    float f90 = dielectric_grazing(f0);
    return specular.w * (tinted + (max(vec3(f90), tinted) - tinted) * schlick_weight(cosine));
}

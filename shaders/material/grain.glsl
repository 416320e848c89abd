// SPDX-License-Identifier: MIT
// The microfacet lobe of a surface that is rougher along one direction (KHR_materials_anisotropy).
// Heitz 2014, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", eq. 80 and
// 86 (GGX), with the height-correlated masking of eq. 99. The twin of rt_reflect.c.
// t, b: unit, along the rough direction and across it; alpha: their roughnesses, squared.
float grain_lobe(vec3 n, vec3 t, vec3 b, vec3 h, vec3 l, vec3 v, vec2 alpha, float n_dot_l,
                 float n_dot_v)
{
    vec3 slope = vec3(dot(t, h) / alpha.x, dot(b, h) / alpha.y, max(dot(n, h), 0.0));
    float f = dot(slope, slope);
    float d = 1.0 / max(3.14159265359 * alpha.x * alpha.y * f * f, 1e-20);
    float of_v = n_dot_l * length(vec3(alpha * vec2(dot(t, v), dot(b, v)), n_dot_v));
    float of_l = n_dot_v * length(vec3(alpha * vec2(dot(t, l), dot(b, l)), n_dot_l));
    return d * 0.5 / max(of_v + of_l, 1e-10);
}

// Roughness squared along the direction, of a surface that has alpha across it.
float grain_alpha(float alpha, float strength)
{
    return mix(alpha, 1.0, strength * strength);
}

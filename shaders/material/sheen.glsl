// SPDX-License-Identifier: MIT
// Fibres that stand up from a surface. Estevez and Kulla 2017, "Production Friendly Microfacet
// Sheen BRDF", as KHR_materials_sheen has it. alpha = roughness^2.
#include "shared/sheen_albedo.h"
const float SHEEN_ALBEDOS[SHEEN_ALBEDO_SIDE * SHEEN_ALBEDO_SIDE] =
    float[SHEEN_ALBEDO_SIDE * SHEEN_ALBEDO_SIDE](SHEEN_ALBEDO);

float sheen_lambda_fit(float x, float alpha)
{
    float t = (1.0 - alpha) * (1.0 - alpha);
    float a = mix(21.5473, 25.3245, t), b = mix(3.82987, 3.32435, t), c = mix(0.19823, 0.16801, t);
    return a / (1.0 + b * pow(x, c)) + mix(-1.97760, -1.27393, t) * x + mix(-4.32054, -4.85967, t);
}

float sheen_lambda(float cosine, float alpha)
{
    if (cosine < 0.5)
        return exp(sheen_lambda_fit(cosine, alpha));
    return exp(2.0 * sheen_lambda_fit(0.5, alpha) - sheen_lambda_fit(1.0 - cosine, alpha));
}

// Distribution times visibility, of unit vectors.
float sheen_lobe(vec3 n, vec3 h, float n_dot_l, float n_dot_v, float roughness)
{
    float alpha = max(roughness, SHEEN_ROUGHNESS_LEAST);
    alpha *= alpha;
    vec3 across = cross(n, h);
    float d = (2.0 + 1.0 / alpha) * pow(dot(across, across), 0.5 / alpha) * 0.15915494309;
    float shadowing = 1.0 + sheen_lambda(n_dot_v, alpha) + sheen_lambda(n_dot_l, alpha);
    return d * min(1.0 / (4.0 * n_dot_v * n_dot_l * shadowing), 1.0);
}

// Of a uniform light from everywhere: the share that the lobe sends to the viewer. Above 1 for
// smooth fibres at grazing angles.
float sheen_albedo(float n_dot_v, float roughness)
{
    const float last = float(SHEEN_ALBEDO_SIDE - 1);
    float x = clamp((roughness - SHEEN_ROUGHNESS_LEAST) / (1.0 - SHEEN_ROUGHNESS_LEAST), 0.0, 1.0);
    vec2 at = vec2(sqrt(clamp(n_dot_v, 0.0, 1.0)), pow(x, 2.0 / 3.0)) * last;
    ivec2 cell = min(ivec2(at), ivec2(SHEEN_ALBEDO_SIDE - 2));
    vec2 f = at - vec2(cell);
    int i = cell.y * SHEEN_ALBEDO_SIDE + cell.x;
    float below = mix(SHEEN_ALBEDOS[i], SHEEN_ALBEDOS[i + 1], f.x);
    i += SHEEN_ALBEDO_SIDE;
    return mix(below, mix(SHEEN_ALBEDOS[i], SHEEN_ALBEDOS[i + 1], f.x), f.y);
}

float largest_of(vec3 color)
{
    return max(color.r, max(color.g, color.b));
}

// What fibres of that colour leave of the light of all below them, towards the viewer.
float sheen_base_share(vec3 color, float n_dot_v, float roughness)
{
    return 1.0 - largest_of(color) * min(sheen_albedo(n_dot_v, roughness), 1.0);
}

// SPDX-License-Identifier: MIT
// A thin coat of index 1.5 over a surface (KHR_materials_clearcoat). Needs: fresnel.glsl.
const float COAT_F0 = 0.04; // of ior 1.5

// The share of light that the coat reflects instead of all below it.
float coat_share(float coat, float n_dot_v)
{
    return coat * (COAT_F0 + (1.0 - COAT_F0) * schlick_weight(n_dot_v));
}

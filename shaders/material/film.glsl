// SPDX-License-Identifier: MIT
// Reflection by a thin film over a base (KHR_materials_iridescence). Belcour and Barla 2017, "A
// Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", eq. 1 to 10:
// the Airy sum of what goes to and fro inside, its phases weighed by the eye. The twin of
// renderer/raytrace/rt_film.c. Needs: fresnel.glsl.
// Deviations: channels are clamped to [0, 1], so that no film sends more light than arrives, and
// what a film thinner than FILM_LEAST_NM reflects fades into what the base does.
#include "shared/thin_film.h"

// What the eye sees of a cosine whose argument grows with the wave number: way [m], turned by shift
// [rad]; linear Rec.709 of luminance 1 without either.
vec3 film_seen(float way, vec3 shift)
{
    const float tau = 6.28318530718;
    const vec3 height = vec3(FILM_HEIGHT_X, FILM_HEIGHT_Y, FILM_HEIGHT_Z) *
                        sqrt(tau * vec3(FILM_VARIANCE_X, FILM_VARIANCE_Y, FILM_VARIANCE_Z));
    const float height_2 = FILM_HEIGHT_X2 * sqrt(tau * FILM_VARIANCE_X2);
    float p = tau * way;
    vec3 middle = vec3(FILM_MIDDLE_X, FILM_MIDDLE_Y, FILM_MIDDLE_Z);
    vec3 variance = vec3(FILM_VARIANCE_X, FILM_VARIANCE_Y, FILM_VARIANCE_Z);
    vec3 xyz = height * cos(middle * p + shift) * exp(-variance * p * p);
    xyz.x += height_2 * cos(FILM_MIDDLE_X2 * p + shift.x) * exp(-FILM_VARIANCE_X2 * p * p);
    xyz /= FILM_WHITE;
    const mat3 rgb_from_xyz = mat3(3.2404542, -0.9692660, 0.0556434, -1.5371385, 1.8760108,
                                   -0.2040259, -0.4985314, 0.0415560, 1.0572252);
    return rgb_from_xyz * xyz;
}

// f0: reflectance of the base in air, per channel; ior: of the film, at least 1; cosine: between
// ray and normal, in air, [0, 1].
vec3 film_fresnel(vec3 f0, float ior, float thickness_nm, float cosine)
{
    const float pi = 3.14159265359;
    float n = ior;
    float inside = sqrt(max(1.0 - (1.0 - cosine * cosine) / (n * n), 0.0));
    float first_f0 = (n - 1.0) / (n + 1.0);
    first_f0 *= first_f0;
    float first = first_f0 + (1.0 - first_f0) * schlick_weight(cosine);
    float passed = 1.0 - first;
    vec3 root = sqrt(clamp(f0, 0.0, 0.9999));
    vec3 base_ior = (1.0 + root) / (1.0 - root);
    vec3 second_f0 = (base_ior - n) / (base_ior + n);
    second_f0 *= second_f0;
    vec3 second = second_f0 + (1.0 - second_f0) * schlick_weight(inside);
    // of a way to and fro inside: phi_21 + phi_23
    vec3 shift = vec3(pi) + mix(vec3(0.0), vec3(pi), lessThan(base_ior, vec3(n)));
    float way = 2e-9 * n * thickness_nm * inside;
    vec3 both = min(first * second, 0.9999), step_ = sqrt(both);
    vec3 whole = passed * passed * second / (1.0 - both);
    vec3 sum = first + whole, term = whole - passed;
    for (int m = 1; m <= 2; m++) {
        term *= step_;
        sum += term * 2.0 * film_seen(float(m) * way, float(m) * shift);
    }
    vec3 bare = f0 + (1.0 - f0) * schlick_weight(cosine);
    return clamp(mix(bare, sum, smoothstep(0.0, FILM_LEAST_NM, thickness_nm)), 0.0, 1.0);
}

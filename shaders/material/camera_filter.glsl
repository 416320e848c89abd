// SPDX-License-Identifier: MIT
// What a transparent surface lets through to the camera (docs/explanation/shading.md). Needs:
// material.glsl, surface.glsl.
// Every factor is carried as its transmittance t and as its opacity o = 1 - t, each computed
// without subtracting what is nearly equal: an error of a rounding per layer, relative to the
// smaller of both, is what ten thousand layers allow.
#include "material/fresnel.glsl"
#include "material/sheen.glsl"
#include "material/clearcoat.glsl"
#ifdef HAS_MORE_LOBES
#include "material/film.glsl"
#endif
#include "material/filter_word.glsl"

struct camera_factor {
    vec3 t, o;
};

camera_factor factor_of_transmittance(vec3 t)
{
    return camera_factor(t, 1.0 - t);
}

camera_factor factor_of_opacity(vec3 o)
{
    return camera_factor(1.0 - o, o);
}

camera_factor factor_of_depth(vec3 tau)
{
    vec3 series = tau * (1.0 - tau / 2.0 * (1.0 - tau / 3.0 * (1.0 - tau / 4.0)));
    vec3 t = exp(-tau);
    return camera_factor(t, mix(1.0 - t, series, lessThan(tau, vec3(0.03125))));
}

camera_factor factor_product(camera_factor a, camera_factor b)
{
    return camera_factor(a.t * b.t, a.o + a.t * b.o);
}

// a^power, as filter_power of material.glsl.
camera_factor factor_power(camera_factor a, float power)
{
    vec3 x = -a.o;
    vec3 series = x * (1.0 + x * (-0.5 + x * (1.0 / 3.0 + x * (-0.25 + x * 0.2))));
    vec3 ln = mix(log(max(a.t, 1e-37)), series, greaterThan(a.t, vec3(0.9375)));
    camera_factor b = factor_of_depth(-ln * power);
    bvec3 is_black = lessThanEqual(a.t, vec3(0.0));
    return camera_factor(mix(b.t, vec3(0.0), is_black), mix(b.o, vec3(1.0), is_black));
}

// Of the material alone: docs/explanation/shading.md, section 1, as light is filtered, but for
// surfaces that cover.
camera_factor camera_material_factor(surface s, float transmission, float thickness_m,
                                     float n_dot_v)
{
    material_record r = materials[s.material];
    camera_factor f = factor_product(factor_of_transmittance(vec3(transmission)),
                                     factor_of_transmittance(s.base));
    if (thickness_m > 0.0 && s.is_front)
        f = factor_product(f, factor_of_depth(r.attenuation.rgb * thickness_m));
    if (MATERIAL_IS(r.flags, MATERIAL_BLEND))
        f = camera_factor((1.0 - s.alpha) + s.alpha * f.t, s.alpha * f.o);
    float c = clamp(n_dot_v, 1e-6, 1.0);
    if (MATERIAL_IS(r.flags, MATERIAL_PASS_SLAB)) {
        f = factor_power(f, 1.0 / c);
    } else if (MATERIAL_IS(r.flags, MATERIAL_PASS_EDGE)) {
        float w = pow(c, r.transmission_f0_thickness.w);
        f = factor_product(f, factor_of_opacity((1.0 - r.edge_color.rgb) * (1.0 - w)));
    }
    return f;
}

// Blended surfaces cover (glTF 2.0, 3.9.4), transmissive ones filter what the dielectric interface
// did not reflect (KHR_materials_transmission). reflected: the share that it did. A word of
// filter_word.glsl.
vec3 camera_filter(surface s, float transmission, float thickness_m, float n_dot_v, float reflected)
{
    material_record r = materials[s.material];
    camera_factor f = factor_of_opacity(vec3(s.alpha));
    if (MATERIAL_IS(r.flags, MATERIAL_TRANSMISSION)) {
        f = camera_material_factor(s, transmission, thickness_m, n_dot_v);
        f = factor_product(f, factor_of_opacity(vec3(s.alpha * reflected)));
        f = factor_product(f, factor_of_opacity(vec3(s.alpha * s.metallic)));
    }
    return filter_pack(clamp(f.t, 0.0, 1.0), clamp(f.o, 0.0, 1.0));
}

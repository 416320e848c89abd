// SPDX-License-Identifier: MIT
// What a surface sends on of the whole area of a light, without its shadow: Lambert's form factor
// for what is diffuse, and linearly transformed cosines for GGX lobes (Heitz, Dupuy, Hill, Neubelt
// 2016), whose parameters tests/support/area_lobe_fit.c has found for this BRDF.
// docs/explanation/shading.md, section 4, tells what is exact and what is not.
// Needs: brdf.glsl, area_form.glsl. Provides, where HAS_AREA_FORM: area_surface_of, area_reflected.
#ifdef HAS_AREA_FORM
layout(binding = UNIT_AREA_LOBES) uniform samplerBuffer u_area_lobes; // struct area_lobe_record

// In the frame of a surface: x along the view, z along the normal.
struct area_lobe {
    mat3 to, from;  // to the cosine's space, and from there
    float energy;   // of a uniform light from everywhere, the share that is sent on if all reflect
    float fresnel;  // then: the mean of Schlick's weight, over the lobe
    float diffuse;  // then: likewise over Lambert's lobe
};

struct area_surface {
    mat3 frame, coat_frame; // rows: axes in view space
    vec3 view;              // in the frame
    area_lobe base, coat;
};

const area_lobe AREA_NO_LOBE = area_lobe(mat3(1.0), mat3(1.0), 0.0, 0.0, 0.0);
const area_surface AREA_NO_SURFACE =
    area_surface(mat3(1.0), mat3(1.0), vec3(0.0), AREA_NO_LOBE, AREA_NO_LOBE);

mat3 area_frame(vec3 n, vec3 view)
{
    vec3 x = view - n * dot(n, view);
    if (dot(x, x) < 1e-10)
        x = abs(n.x) < 0.5 ? vec3(1.0, 0.0, 0.0) - n * n.x : vec3(0.0, 1.0, 0.0) - n * n.y;
    x = normalize(x);
    return transpose(mat3(x, cross(n, x), n));
}

// stretch: what turns roughness alike in all directions into that of a grain: x' = .x x,
// y' = .y x + .z y.
area_lobe area_lobe_of(float alpha, float n_dot_v, vec3 stretch)
{
    const float last = float(AREA_LOBE_SIDE - 1);
    vec2 at = vec2(sqrt(clamp(1.0 - n_dot_v, 0.0, 1.0)),
                   (sqrt(alpha) - AREA_LOBE_LEAST) / (1.0 - AREA_LOBE_LEAST));
    at = clamp(at, 0.0, 1.0) * last;
    ivec2 cell = min(ivec2(at), ivec2(AREA_LOBE_SIDE - 2));
    vec2 f = at - vec2(cell);
    int i = 2 * (cell.y * AREA_LOBE_SIDE + cell.x), row = 2 * AREA_LOBE_SIDE;
    vec4 shape = mix(mix(texelFetch(u_area_lobes, i), texelFetch(u_area_lobes, i + 2), f.x),
                     mix(texelFetch(u_area_lobes, i + row), texelFetch(u_area_lobes, i + row + 2),
                         f.x), f.y);
    i++;
    vec4 sums = mix(mix(texelFetch(u_area_lobes, i), texelFetch(u_area_lobes, i + 2), f.x),
                    mix(texelFetch(u_area_lobes, i + row), texelFetch(u_area_lobes, i + row + 2),
                        f.x), f.y);
    float a = shape.x * alpha;
    float c = shape.y * alpha * sqrt(n_dot_v * n_dot_v * (1.0 - alpha * alpha) + alpha * alpha);
    float b = shape.z, n_cross_v = sqrt(max(1.0 - n_dot_v * n_dot_v, 0.0));
    float sine = sin(shape.w) * n_dot_v - cos(shape.w) * n_cross_v;
    float cosine = cos(shape.w) * n_dot_v + sin(shape.w) * n_cross_v;
    area_lobe lobe;
    lobe.from = mat3(cosine * a, 0.0, -sine * a, 0.0, c, 0.0, cosine * b + sine, 0.0,
                     cosine - sine * b);
    lobe.to = mat3((cosine - b * sine) / a, 0.0, sine, 0.0, 1.0 / c, 0.0,
                   -(sine + b * cosine) / a, 0.0, cosine);
    lobe.from *= mat3(stretch.x, stretch.y, 0.0, 0.0, stretch.z, 0.0, 0.0, 0.0, 1.0);
    lobe.to = mat3(1.0 / stretch.x, -stretch.y / (stretch.x * stretch.z), 0.0, 0.0,
                   1.0 / stretch.z, 0.0, 0.0, 0.0, 1.0) * lobe.to;
    // a lobe that leans below the horizon has less above it: the lune between two planes
    vec3 up = vec3(lobe.from[0].z, lobe.from[1].z, lobe.from[2].z);
    lobe.energy = sums.x * 2.0 / (1.0 + up.z * inversesqrt(dot(up, up)));
    lobe.fresnel = schlick_weight(sums.y);
    lobe.diffuse = schlick_weight(sums.z);
    return lobe;
}

#ifdef HAS_MORE_LOBES
// Of a grain: the covariance of its slopes as seen in the frame, by its Cholesky factors.
area_lobe area_grain_lobe(brdf_input b, mat3 frame, float n_dot_v)
{
    float along = b.grain.w * b.grain.w, across = b.alpha * b.alpha;
    vec2 turn = (frame * b.grain.xyz).xy;
    turn *= inversesqrt(max(dot(turn, turn), 1e-20));
    vec3 covariance = vec3(along * turn.x * turn.x + across * turn.y * turn.y,
                           (along - across) * turn.x * turn.y,
                           along * turn.y * turn.y + across * turn.x * turn.x);
    float round_ = sqrt(b.grain.w * b.alpha);
    float x = sqrt(covariance.x);
    vec3 stretch = vec3(x, covariance.y / x, b.grain.w * b.alpha / x) / round_;
    return area_lobe_of(round_, n_dot_v, stretch);
}
#endif

area_surface area_surface_of(brdf_input b)
{
    area_surface s;
    float n_dot_v = clamp(dot(b.normal, b.view), 1e-4, 1.0);
    s.frame = s.coat_frame = area_frame(b.normal, b.view);
    s.view = s.frame * b.view;
    s.base = s.coat = area_lobe_of(b.alpha, n_dot_v, vec3(1.0, 0.0, 1.0));
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_GRAIN) && b.grain.w > 0.0)
        s.base = area_grain_lobe(b, s.frame, n_dot_v);
#endif
    if (MATERIAL_MAY_BE(MATERIAL_CLEARCOAT) && b.below_coat < 1.0) {
        s.coat_frame = area_frame(b.coat_normal, b.view);
        s.coat = area_lobe_of(b.coat_alpha, clamp(dot(b.coat_normal, b.view), 1e-4, 1.0),
                              vec3(1.0, 0.0, 1.0));
    }
    return s;
}

// The cosine at which Schlick's weight is its mean: of a small light that of its direction, of one
// that fills the lobe that of the lobe.
float area_cosine(vec3 direction, vec3 view, float of_all, float filled)
{
    float w = schlick_weight(0.5 * length(area_unit(direction) + view));
    return 1.0 - pow(max(mix(w, of_all, clamp(filled, 0.0, 1.0)), 1e-30), 0.2);
}

float area_lobe_cosine(area_surface at, vec3 form)
{
    return area_cosine(at.base.from * form, at.view, at.base.fresnel, form.z);
}

// Light on the normal's side.
vec3 area_reflected_above(area_surface at, brdf_input b, area_source s, vec3 lit)
{
    vec3 form = area_lobe_form(s, at.base.to);
    float cosine = area_lobe_cosine(at, form), lobe = at.base.energy * form.z;
    vec3 diffuse = b.base * ((1.0 - b.transmission) * lit.z);
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT))
        diffuse *= 1.0 - b.translucent.w;
#endif
    float between = area_cosine(lit, at.view, at.base.diffuse, lit.z);
    diffuse *= 1.0 - brdf_fresnel(brdf_mirrors_at(b, between));
    brdf_mirrors mirrors = brdf_mirrors_at(b, cosine);
    return mix(diffuse + mirrors.dielectric * lobe, mirrors.metal * lobe, b.metallic);
}

// Light from behind, s mirrored to the normal's side: through the lobe of transmission, or
// diffused.
vec3 area_passed(area_surface at, brdf_input b, area_source s)
{
    vec3 form = area_lobe_form(s, at.base.to);
    float fresnel = brdf_fresnel(brdf_mirrors_at(b, area_lobe_cosine(at, form)));
    vec3 sent = b.base * (b.transmission * (1.0 - fresnel) * at.base.energy * form.z);
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT) && b.translucent.w > 0.0) {
        vec3 lit = area_diffuse_form(s);
        float between = area_cosine(lit, at.view, at.base.diffuse, lit.z);
        fresnel = brdf_fresnel(brdf_mirrors_at(b, between));
        sent += b.translucent.rgb *
                (b.translucent.w * (1.0 - b.transmission) * (1.0 - fresnel) * lit.z);
    }
#endif
    return sent * (1.0 - b.metallic);
}

// Fibres change slowly with the light's direction: they are taken at the mean of its directions,
// and of a light that is everywhere they send their albedo.
vec3 area_sheen(area_surface at, brdf_input b, vec3 lit)
{
    vec3 l = area_unit(lit), h = area_unit(l + at.view);
    float n_dot_v = max(at.view.z, 1e-4);
    float sent =
        PI * sheen_lobe(vec3(0.0, 0.0, 1.0), h, max(l.z, 1e-4), n_dot_v, b.sheen_roughness);
    float filled = clamp(lit.z, 0.0, 1.0);
    return b.sheen * (lit.z * mix(sent, sheen_albedo(n_dot_v, b.sheen_roughness), filled));
}

// Over the light's radiance. seen: the light in view space, from the surface.
vec3 area_reflected(area_surface at, brdf_input b, area_source seen)
{
    area_source s = area_source_to(at.frame, seen);
    vec3 lit = area_diffuse_form(s), sent = vec3(0.0);
    if (lit.z > 0.0)
        sent = area_reflected_above(at, b, s, lit);
    if (brdf_passes(b)) {
        mat3 turned = mat3(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0);
        sent += area_passed(at, b, area_source_to(turned, s));
    }
    if (MATERIAL_MAY_BE(MATERIAL_SHEEN | MATERIAL_CLEARCOAT)) {
        sent *= b.below_sheen;
        if (MATERIAL_MAY_BE(MATERIAL_SHEEN) && lit.z > 0.0)
            sent += area_sheen(at, b, lit);
        sent *= b.below_coat;
        if (MATERIAL_MAY_BE(MATERIAL_CLEARCOAT) && lit.z > 0.0 && b.below_coat < 1.0)
            sent += (1.0 - b.below_coat) * at.coat.energy *
                    area_lobe_form(area_source_to(at.coat_frame, seen), at.coat.to).z;
    }
    return sent;
}
#endif

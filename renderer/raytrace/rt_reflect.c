/* SPDX-License-Identifier: MIT */
/* Reflection of rays at surfaces. Formulas: docs/explanation/shading.md, glTF 2.0 appendix B. */
#include "renderer/raytrace/rt_reflect.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_film.h"
#include "renderer/raytrace/rt_math.h"

static const double pi = 3.14159265358979323846;
static const double min_alpha = 1e-3;

static void init_grain(struct rt_grain *grain, const struct rt_surface *s, const double view[3],
                       double alpha, double n_dot_v)
{
    grain->is_there = false;
    if (!(s->grain > 0))
        return;
    double up = vec3_dot(s->along, s->normal);
    for (int k = 0; k < 3; k++)
        grain->along[k] = s->along[k] - up * s->normal[k];
    if (!(vec3_dot(grain->along, grain->along) > 1e-12) || !vec3_normalize(grain->along))
        return;
    vec3_cross(s->normal, grain->along, grain->across);
    grain->is_there = true;
    grain->alpha_along = alpha + (1 - alpha) * s->grain * s->grain;
    grain->alpha_across = alpha;
    double t = grain->alpha_along * vec3_dot(grain->along, view);
    double b = grain->alpha_across * vec3_dot(grain->across, view);
    grain->seen = sqrt(t * t + b * b + n_dot_v * n_dot_v);
}

static void init_film(struct rt_filmed *film, const struct rt_surface *s, const double f0[3],
                      double interface)
{
    film->ior = (double)s->material->film_ior;
    film->thickness_nm = s->film_nm;
    film->dielectric = 1 - s->metallic;
    film->interface = interface;
    for (int k = 0; k < 3; k++) {
        film->f0[k] = f0[k];
        film->edge[k] = rt_max(s->f0 + rt_surface_edge(s), f0[k]);
        film->base[k] = s->base[k];
        double diffuse = (1 - s->transmission) / pi * film->dielectric;
        film->diffuse[k] = s->base[k] * (1 - s->translucence) * diffuse;
        film->diffused[k] = s->translucence > 0 ? s->translucent[k] * s->translucence * diffuse : 0;
        film->through[k] = s->base[k] * s->transmission * film->dielectric;
    }
}

/* By base and film together: the factor of the lobe, per channel. Returns the largest share that
 * the dielectric reflects. */
static double film_reflects(const struct rt_filmed *film, double cosine, double w, double out[3])
{
    double under[3], metal[3] = {0, 0, 0}, largest = 0;
    rt_film_fresnel(film->f0, film->ior, film->thickness_nm, cosine, under);
    if (film->dielectric < 1)
        rt_film_fresnel(film->base, film->ior, film->thickness_nm, cosine, metal);
    for (int k = 0; k < 3; k++) {
        double bare = film->f0[k] + (film->edge[k] - film->f0[k]) * w;
        double bare_metal = film->base[k] + (1 - film->base[k]) * w;
        double dielectric = film->interface * (bare + film->weight * (under[k] - bare));
        out[k] = film->dielectric * dielectric +
                 (1 - film->dielectric) * (bare_metal + film->weight * (metal[k] - bare_metal));
        largest = rt_max(largest, dielectric);
    }
    return largest;
}

void rt_reflector_init(struct rt_reflector *r, const struct rt_surface *s, const double view[3])
{
    double alpha = rt_max(s->roughness * s->roughness, min_alpha), a2 = alpha * alpha;
    double n_dot_v = rt_max(vec3_dot(s->normal, view), 1e-4);
    double edge = rt_surface_edge(s), dielectric = 1 - s->metallic, weight = 1, f0[3];
    double largest = rt_surface_specular(s, f0, &weight);
    double lost = weight * largest, lost_edge = weight * (rt_max(s->f0 + edge, largest) - largest);
    memcpy(r->normal, s->normal, sizeof r->normal);
    memcpy(r->view, view, sizeof r->view);
    r->n_dot_v = n_dot_v;
    r->alpha_square = a2;
    r->seen = sqrt(n_dot_v * n_dot_v * (1 - a2) + a2);
    r->transmits = (s->transmission > 0 || s->translucence > 0) && s->metallic < 1;
    for (int k = 0; k < 3; k++) {
        double passed = (1 - s->transmission) / pi * dielectric;
        double diffuse = s->base[k] * (1 - s->translucence) * passed;
        double diffused = s->translucence > 0 ? s->translucent[k] * s->translucence * passed : 0;
        double through = s->base[k] * s->transmission * dielectric;
        double rise = rt_max(s->f0 + edge, f0[k]) - f0[k];
        r->diffuse[k] = diffuse * (1 - lost);
        r->diffuse_edge[k] = diffuse * lost_edge;
        r->diffused[k] = diffused * (1 - lost);
        r->diffused_edge[k] = diffused * lost_edge;
        r->specular[k] = dielectric * weight * f0[k] + s->metallic * s->base[k];
        r->specular_edge[k] = dielectric * weight * rise + s->metallic * (1 - s->base[k]);
        r->through[k] = through * (1 - lost);
        r->through_edge[k] = through * lost_edge;
    }
    init_grain(&r->grain, s, view, alpha, n_dot_v);
    if (r->grain.is_there)
        r->alpha_square = r->grain.alpha_along * r->grain.alpha_across;
    r->film.weight = s->film;
    if (s->film > 0)
        init_film(&r->film, s, f0, weight);
    rt_lobes_init(&r->lobes, s, view);
}

void rt_reflector_emission(const struct rt_reflector *r, const struct rt_surface *s, double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = s->emissive[k] * r->lobes.below_coat;
}

/* D and V of appendix B.3.2 and B.3.3. seen: the visibility function's root for the viewer. */
static double ggx_of(double a2, double n_dot_v, double seen, double n_dot_h, double n_dot_l)
{
    double f = n_dot_h * n_dot_h * (a2 - 1) + 1;
    double visibility = n_dot_v * sqrt(n_dot_l * n_dot_l * (1 - a2) + a2) + n_dot_l * seen;
    return 0.5 * a2 / (pi * f * f * rt_max(visibility, 1e-10));
}

/* D and V of an anisotropic lobe. Heitz 2014, "Understanding the Masking-Shadowing Function in
 * Microfacet-Based BRDFs", eq. 80, 86 and 99. h: unit. */
static double grain_of(const struct rt_reflector *r, const double h[3], const double l[3],
                       double n_dot_h, double n_dot_l)
{
    const struct rt_grain *g = &r->grain;
    double a = g->alpha_along, b = g->alpha_across;
    double x = vec3_dot(g->along, h) / a, y = vec3_dot(g->across, h) / b;
    double f = x * x + y * y + n_dot_h * n_dot_h;
    double t = a * vec3_dot(g->along, l), c = b * vec3_dot(g->across, l);
    double visibility = n_dot_l * g->seen + r->n_dot_v * sqrt(t * t + c * c + n_dot_l * n_dot_l);
    return 0.5 / (pi * a * b * f * f * rt_max(visibility, 1e-10));
}

/* Cosines at the half vector of light and view, and Schlick's power there. */
struct half {
    double n_dot_h, v_dot_h, w;
};

/* The lobe between l and v. */
static double ggx(const struct rt_reflector *r, const double l[3], double n_dot_l,
                  struct half *half)
{
    double h[3] = {l[0] + r->view[0], l[1] + r->view[1], l[2] + r->view[2]};
    double square = vec3_dot(h, h), inverse = square > 0 ? 1 / sqrt(square) : 0;
    double n_dot_h = rt_min(rt_max(vec3_dot(r->normal, h) * inverse, 0), 1);
    double c = rt_min(rt_max(1 - vec3_dot(r->view, h) * inverse, 0), 1), c2 = c * c;
    *half = (struct half){.n_dot_h = n_dot_h, .v_dot_h = 1 - c, .w = c2 * c2 * c};
    for (int k = 0; k < 3; k++)
        h[k] *= inverse;
    if (r->grain.is_there)
        return grain_of(r, h, l, n_dot_h, n_dot_l);
    return ggx_of(r->alpha_square, r->n_dot_v, r->seen, n_dot_h, n_dot_l);
}

/* Fibres and coat over the base's light; n_dot_l > 0. */
static void add_lobes(const struct rt_reflector *r, const double l[3], double n_dot_h,
                      double n_dot_l, double out[3])
{
    const struct rt_lobes *lobes = &r->lobes;
    double fibre = lobes->has_sheen
                       ? rt_sheen_lobe(lobes->sheen_alpha, n_dot_h, n_dot_l, r->n_dot_v) * n_dot_l
                       : 0;
    double coat = 0;
    double coat_n_dot_l = vec3_dot(lobes->coat_normal, l);
    if (lobes->has_coat && coat_n_dot_l > 0) {
        double a2 = lobes->coat_alpha_square, n_dot_v = lobes->coat_n_dot_v;
        double seen = sqrt(n_dot_v * n_dot_v * (1 - a2) + a2);
        double h[3] = {l[0] + r->view[0], l[1] + r->view[1], l[2] + r->view[2]};
        double coat_n_dot_h = vec3_normalize(h) ? rt_max(vec3_dot(lobes->coat_normal, h), 0) : 0;
        coat = lobes->coat * ggx_of(a2, n_dot_v, seen, coat_n_dot_h, coat_n_dot_l) * coat_n_dot_l;
    }
    for (int k = 0; k < 3; k++)
        out[k] = (out[k] * lobes->below_sheen + lobes->sheen[k] * fibre) * lobes->below_coat + coat;
}

bool rt_reflect(const struct rt_reflector *r, const double l[3], double out[3])
{
    double n_dot_l = vec3_dot(r->normal, l), filmed[3], largest = 0;
    const bool has_film = r->film.weight > 0;
    struct half half;
    const bool has_lobes = r->lobes.has_sheen || r->lobes.has_coat;
    if (n_dot_l > 0) {
        double lobe = ggx(r, l, n_dot_l, &half);
        if (has_film)
            largest = film_reflects(&r->film, half.v_dot_h, half.w, filmed);
        for (int k = 0; k < 3; k++)
            out[k] = (has_film ? r->film.diffuse[k] * (1 - largest) + lobe * filmed[k]
                               : r->diffuse[k] - half.w * r->diffuse_edge[k] +
                                     lobe * (r->specular[k] + half.w * r->specular_edge[k])) *
                     n_dot_l;
        if (has_lobes)
            add_lobes(r, l, half.n_dot_h, n_dot_l, out);
    } else {
        double mirrored[3];
        if (!r->transmits)
            return false;
        for (int k = 0; k < 3; k++)
            mirrored[k] = l[k] - 2 * n_dot_l * r->normal[k];
        double lobe = ggx(r, mirrored, rt_max(-n_dot_l, 1e-4), &half);
        if (has_film)
            largest = film_reflects(&r->film, half.v_dot_h, half.w, filmed);
        for (int k = 0; k < 3; k++)
            out[k] = (has_film ? (r->film.through[k] * lobe + r->film.diffused[k]) * (1 - largest)
                               : (r->through[k] - half.w * r->through_edge[k]) * lobe +
                                     r->diffused[k] - half.w * r->diffused_edge[k]) *
                     -n_dot_l * rt_lobes_passed(&r->lobes);
    }
    return out[0] > 0 || out[1] > 0 || out[2] > 0;
}

/* Karis 2014, "Physically Based Shading on Mobile". */
static void environment_split(double roughness, double n_dot_v, double split[2])
{
    double r[4] = {1 - roughness, 0.0425 - 0.0275 * roughness, 1.04 - 0.572 * roughness,
                   0.022 * roughness - 0.04};
    double a = rt_min(r[0] * r[0], exp2(-9.28 * n_dot_v)) * r[0] + r[1];
    split[0] = -1.04 * a + r[2];
    split[1] = 1.04 * a + r[3];
}

/* The light that a lobe of that roughness mirrors to the viewer. */
static double mirrored_share(const double normal[3], const double view[3], double roughness)
{
    double mirror_y = 2 * vec3_dot(normal, view) * normal[1] - view[1];
    return rt_min(rt_max(0.5 + 0.5 * mirror_y / (0.05 + 0.95 * roughness), 0), 1);
}

/* What stands for the reflectance of a filmed base, head on, in the view's direction. Returns the
 * largest of the dielectric's. */
static double film_f0s(const struct rt_surface *s, double n_dot_v, double dielectric[3],
                       double metal[3])
{
    double ior = (double)s->material->film_ior, under[3], over[3], largest = 0;
    rt_film_f0(dielectric, ior, s->film_nm, n_dot_v, under);
    rt_film_f0(metal, ior, s->film_nm, n_dot_v, over);
    for (int k = 0; k < 3; k++) {
        dielectric[k] += s->film * (under[k] - dielectric[k]);
        metal[k] += s->film * (over[k] - metal[k]);
        largest = rt_max(largest, dielectric[k]);
    }
    return largest;
}

void rt_reflect_hemisphere(const struct scene_state *state, const struct rt_reflector *r,
                           const struct rt_surface *s, double out[3])
{
    double n_dot_v = rt_min(rt_max(vec3_dot(s->normal, r->view), 0), 1);
    /* a lobe with a grain is taken as round as it is rough in the mean */
    double roughness = r->grain.is_there ? sqrt(sqrt(r->alpha_square)) : s->roughness;
    double up = 0.5 + 0.5 * s->normal[1], mirror_up = mirrored_share(r->normal, r->view, roughness);
    double coat_up =
        mirrored_share(r->lobes.coat_normal, r->view, sqrt(sqrt(r->lobes.coat_alpha_square)));
    double split[2], f0s[3], weight = 1, largest = rt_surface_specular(s, f0s, &weight);
    double metal[3] = {s->base[0], s->base[1], s->base[2]};
    double most = s->f0 + rt_surface_edge(s); /* at grazing angles */
    environment_split(roughness, n_dot_v, split);
    if (s->film > 0)
        largest = film_f0s(s, n_dot_v, f0s, metal);
    for (int k = 0; k < 3; k++) {
        double ground = (double)state->ground[k], range = (double)state->sky[k] - ground;
        double f0 = weight * f0s[k] + (metal[k] - weight * f0s[k]) * s->metallic;
        double edge = weight * most + (1 - weight * most) * s->metallic;
        double diffuse = (1 - s->metallic) * (1 - s->transmission) * (1 - weight * largest);
        double behind = s->translucence > 0
                            ? s->translucence * s->translucent[k] * (ground + range * (1 - up))
                            : 0;
        double base =
            diffuse * (s->base[k] * (1 - s->translucence) * (ground + range * up) + behind) +
            (ground + range * mirror_up) * (f0 * split[0] + edge * split[1]);
        double fibres = r->lobes.has_sheen
                            ? r->lobes.color[k] * r->lobes.sheen_sent * (ground + range * up)
                            : 0;
        out[k] += ((base * r->lobes.below_sheen + fibres) * r->lobes.below_coat +
                   r->lobes.coat * (ground + range * coat_up)) *
                  s->occlusion;
    }
}

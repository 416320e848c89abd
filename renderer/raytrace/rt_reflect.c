/* SPDX-License-Identifier: MIT */
/* Reflection of rays at surfaces. Formulas: docs/explanation/shading.md, glTF 2.0 appendix B. */
#include "renderer/raytrace/rt_reflect.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_math.h"

static const double pi = 3.14159265358979323846;
static const double min_alpha = 1e-3;

void rt_reflector_init(struct rt_reflector *r, const struct rt_surface *s, const double view[3])
{
    double alpha = rt_max(s->roughness * s->roughness, min_alpha), a2 = alpha * alpha;
    double n_dot_v = rt_max(vec3_dot(s->normal, view), 1e-4);
    double edge = rt_surface_edge(s), dielectric = 1 - s->metallic;
    memcpy(r->normal, s->normal, sizeof r->normal);
    memcpy(r->view, view, sizeof r->view);
    r->n_dot_v = n_dot_v;
    r->alpha_square = a2;
    r->seen = sqrt(n_dot_v * n_dot_v * (1 - a2) + a2);
    r->transmits = s->transmission > 0 && s->metallic < 1;
    for (int k = 0; k < 3; k++) {
        double diffuse = s->base[k] * (1 - s->transmission) / pi * dielectric;
        double through = s->base[k] * s->transmission * dielectric;
        r->diffuse[k] = diffuse * (1 - s->f0);
        r->diffuse_edge[k] = diffuse * edge;
        r->specular[k] = dielectric * s->f0 + s->metallic * s->base[k];
        r->specular_edge[k] = dielectric * edge + s->metallic * (1 - s->base[k]);
        r->through[k] = through * (1 - s->f0);
        r->through_edge[k] = through * edge;
    }
}

/* D and V of appendix B.3.2 and B.3.3 between l and v, and Schlick's power at their half vector. */
static double ggx(const struct rt_reflector *r, const double l[3], double n_dot_l, double *w)
{
    double h[3] = {l[0] + r->view[0], l[1] + r->view[1], l[2] + r->view[2]};
    double square = vec3_dot(h, h), inverse = square > 0 ? 1 / sqrt(square) : 0;
    double n_dot_h = rt_min(rt_max(vec3_dot(r->normal, h) * inverse, 0), 1);
    double c = rt_min(rt_max(1 - vec3_dot(r->view, h) * inverse, 0), 1), c2 = c * c;
    double a2 = r->alpha_square, f = n_dot_h * n_dot_h * (a2 - 1) + 1;
    double visibility = r->n_dot_v * sqrt(n_dot_l * n_dot_l * (1 - a2) + a2) + n_dot_l * r->seen;
    *w = c2 * c2 * c;
    return 0.5 * a2 / (pi * f * f * rt_max(visibility, 1e-10));
}

bool rt_reflect(const struct rt_reflector *r, const double l[3], double out[3])
{
    double n_dot_l = vec3_dot(r->normal, l), w;
    if (n_dot_l > 0) {
        double lobe = ggx(r, l, n_dot_l, &w);
        for (int k = 0; k < 3; k++)
            out[k] = (r->diffuse[k] - w * r->diffuse_edge[k] +
                      lobe * (r->specular[k] + w * r->specular_edge[k])) *
                     n_dot_l;
    } else {
        double mirrored[3];
        if (!r->transmits)
            return false;
        for (int k = 0; k < 3; k++)
            mirrored[k] = l[k] - 2 * n_dot_l * r->normal[k];
        double lobe = ggx(r, mirrored, rt_max(-n_dot_l, 1e-4), &w);
        for (int k = 0; k < 3; k++)
            out[k] = (r->through[k] - w * r->through_edge[k]) * lobe * -n_dot_l;
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

void rt_reflect_hemisphere(const struct scene_state *state, const struct rt_surface *s,
                           const double v[3], double out[3])
{
    double n_dot_v = rt_min(rt_max(vec3_dot(s->normal, v), 0), 1);
    double up = 0.5 + 0.5 * s->normal[1];
    double mirror_y = 2 * vec3_dot(s->normal, v) * s->normal[1] - v[1];
    double spread = 0.05 + 0.95 * s->roughness;
    double mirror_up = rt_min(rt_max(0.5 + 0.5 * mirror_y / spread, 0), 1);
    double split[2];
    environment_split(s->roughness, n_dot_v, split);
    for (int k = 0; k < 3; k++) {
        double sky = (double)state->sky[k], ground = (double)state->ground[k];
        double f0 = s->f0 + (s->base[k] - s->f0) * s->metallic;
        double diffuse = s->base[k] * (1 - s->metallic) * (1 - s->transmission) * (1 - s->f0);
        out[k] += (diffuse * (ground + (sky - ground) * up) +
                   (ground + (sky - ground) * mirror_up) * (f0 * split[0] + split[1])) *
                  s->occlusion;
    }
}

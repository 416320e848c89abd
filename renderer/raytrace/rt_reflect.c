/* SPDX-License-Identifier: MIT */
/* Reflection of rays at surfaces. Formulas: docs/shading.md, glTF 2.0 appendix B. */
#include "renderer/raytrace/rt_reflect.h"

#include "renderer/raytrace/rt_math.h"
#include "renderer/scene/matrix.h"

static const double pi = 3.14159265358979323846;
static const double min_alpha = 1e-3;

static double schlick(double cosine)
{
    double c = rt_min(rt_max(1 - cosine, 0), 1), c2 = c * c;
    return c2 * c2 * c;
}

static double ggx(double n_dot_h, double n_dot_l, double n_dot_v, double alpha)
{
    double a2 = alpha * alpha;
    double f = n_dot_h * n_dot_h * (a2 - 1) + 1;
    double d = a2 / (pi * f * f);
    double visibility = n_dot_v * sqrt(n_dot_l * n_dot_l * (1 - a2) + a2) +
                        n_dot_l * sqrt(n_dot_v * n_dot_v * (1 - a2) + a2);
    return d * 0.5 / rt_max(visibility, 1e-10);
}

static void half_vector(const double a[3], const double b[3], double h[3])
{
    for (int k = 0; k < 3; k++)
        h[k] = a[k] + b[k];
    vec3_normalize(h);
}

/* f * cosine of appendix B.3, and the mirrored lobe of KHR_materials_transmission. */
void rt_reflect(const struct rt_surface *s, const double v[3], const double l[3], double out[3])
{
    double alpha = rt_max(s->roughness * s->roughness, min_alpha);
    double n_dot_v = rt_max(vec3_dot(s->normal, v), 1e-4), n_dot_l = vec3_dot(s->normal, l);
    double h[3];
    if (n_dot_l > 0) {
        half_vector(l, v, h);
        double lobe = ggx(rt_min(rt_max(vec3_dot(s->normal, h), 0), 1), n_dot_l, n_dot_v, alpha);
        double w = schlick(vec3_dot(v, h)), fresnel = rt_surface_fresnel(s, vec3_dot(v, h));
        for (int k = 0; k < 3; k++) {
            double diffuse = s->base[k] * (1 - s->transmission) / pi;
            double dielectric = diffuse + (lobe - diffuse) * fresnel;
            double metal = lobe * (s->base[k] + (1 - s->base[k]) * w);
            out[k] = (dielectric + (metal - dielectric) * s->metallic) * n_dot_l;
        }
        return;
    }
    out[0] = out[1] = out[2] = 0;
    if (s->transmission <= 0 || s->metallic >= 1)
        return;
    double mirrored[3];
    for (int k = 0; k < 3; k++)
        mirrored[k] = l[k] - 2 * n_dot_l * s->normal[k];
    half_vector(mirrored, v, h);
    double lobe =
        ggx(rt_min(rt_max(vec3_dot(s->normal, h), 0), 1), rt_max(-n_dot_l, 1e-4), n_dot_v, alpha);
    double fresnel = rt_surface_fresnel(s, vec3_dot(v, h));
    for (int k = 0; k < 3; k++)
        out[k] = s->base[k] * s->transmission * (1 - fresnel) * (1 - s->metallic) * lobe * -n_dot_l;
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

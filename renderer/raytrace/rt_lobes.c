/* SPDX-License-Identifier: MIT */
/* Fibres and coat over a surface's base. */
#include "renderer/raytrace/rt_lobes.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_math.h"
#include "renderer/raytrace/rt_surface.h"
#include "renderer/scene/scene.h"
#include "shaders/shared/sheen_albedo.h"

static const double pi = 3.14159265358979323846;
static const double min_alpha = 1e-3;
static const double coat_f0 = 0.04; /* of ior 1.5 */

static const double albedos[SHEEN_ALBEDO_SIDE * SHEEN_ALBEDO_SIDE] = {SHEEN_ALBEDO};

/* Estevez and Kulla's fit, between the parameters of alpha 1 and those of 0. */
static double lambda_fit(double x, double alpha)
{
    double t = (1 - alpha) * (1 - alpha), u = 1 - t;
    double a = 25.3245 * t + 21.5473 * u, b = 3.32435 * t + 3.82987 * u;
    double c = 0.16801 * t + 0.19823 * u, d = -1.27393 * t - 1.97760 * u;
    return a / (1 + b * pow(x, c)) + d * x - 4.85967 * t - 4.32054 * u;
}

static double lambda(double cosine, double alpha)
{
    if (cosine < 0.5)
        return exp(lambda_fit(cosine, alpha));
    return exp(2 * lambda_fit(0.5, alpha) - lambda_fit(1 - cosine, alpha));
}

double rt_sheen_lobe(double alpha, double n_dot_h, double n_dot_l, double n_dot_v)
{
    double sine_square = rt_max(1 - n_dot_h * n_dot_h, 0);
    double d = (2 + 1 / alpha) * pow(sine_square, 0.5 / alpha) / (2 * pi);
    double shadowing = 1 + lambda(n_dot_v, alpha) + lambda(n_dot_l, alpha);
    return d * rt_min(1 / (4 * n_dot_v * n_dot_l * shadowing), 1);
}

static double along(const double *row, double at)
{
    int cell = (int)rt_min(at, SHEEN_ALBEDO_SIDE - 2);
    return row[cell] + (row[cell + 1] - row[cell]) * (at - cell);
}

double rt_sheen_albedo(double n_dot_v, double roughness)
{
    const double last = SHEEN_ALBEDO_SIDE - 1;
    double x = (roughness - SHEEN_ROUGHNESS_LEAST) / (1 - SHEEN_ROUGHNESS_LEAST);
    double across = sqrt(rt_min(rt_max(n_dot_v, 0), 1)) * last;
    double up = pow(rt_min(rt_max(x, 0), 1), 2.0 / 3) * last;
    int cell = (int)rt_min(up, SHEEN_ALBEDO_SIDE - 2);
    const double *row = &albedos[(size_t)cell * SHEEN_ALBEDO_SIDE];
    double below = along(row, across), above = along(row + SHEEN_ALBEDO_SIDE, across);
    return below + (above - below) * (up - cell);
}

static double cosine_of(const double normal[3], const double view[3])
{
    return rt_min(rt_max(vec3_dot(normal, view), 1e-4), 1);
}

static void add_sheen(struct rt_lobes *lobes, const struct rt_surface *s, const double view[3])
{
    const double *color = s->sheen_color;
    double largest = rt_max(color[0], rt_max(color[1], color[2]));
    double albedo = rt_sheen_albedo(cosine_of(s->normal, view), s->sheen_roughness);
    double roughness = rt_max(s->sheen_roughness, SHEEN_ROUGHNESS_LEAST);
    lobes->has_sheen = largest > 0;
    lobes->sheen_alpha = roughness * roughness;
    lobes->below_sheen = 1 - largest * rt_min(albedo, 1);
    lobes->sheen_sent = rt_min(albedo, 1);
    memcpy(lobes->color, color, sizeof lobes->color);
    for (int k = 0; k < 3; k++)
        lobes->sheen[k] = color[k] / rt_max(albedo, 1);
}

static void add_coat(struct rt_lobes *lobes, const struct rt_surface *s, const double view[3])
{
    double alpha = rt_max(s->coat_roughness * s->coat_roughness, min_alpha);
    double cosine = cosine_of(s->coat_normal, view), c = 1 - cosine, c2 = c * c;
    lobes->has_coat = s->coat > 0;
    lobes->coat = s->coat * (coat_f0 + (1 - coat_f0) * c2 * c2 * c);
    lobes->coat_alpha_square = alpha * alpha;
    lobes->below_coat = 1 - lobes->coat;
    lobes->coat_n_dot_v = cosine;
    memcpy(lobes->coat_normal, s->coat_normal, sizeof lobes->coat_normal);
}

void rt_lobes_init(struct rt_lobes *lobes, const struct rt_surface *s, const double view[3])
{
    const struct scene_material *m = s->material;
    *lobes = (struct rt_lobes){.below_sheen = 1, .below_coat = 1};
    if (scene_material_has_sheen(m))
        add_sheen(lobes, s, view);
    if (m->clearcoat > 0)
        add_coat(lobes, s, view);
}

/* SPDX-License-Identifier: MIT */
/* Drawing directions by a map and by lobes, and their densities. */
#include "renderer/raytrace/rt_environment.h"

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_math.h"

static const double pi = 3.14159265358979323846;

enum { SHARE_COSINE, SHARE_BASE, SHARE_COAT, SHARE_BEHIND, SHARE_COUNT };

uint32_t rt_environment_count(const struct environment_light *light,
                              const struct view_quality *quality)
{
    if (!light || !light->environment || !(light->intensity > 0))
        return 0;
    if (quality->environment_samples)
        return (uint32_t)quality->environment_samples;
    return quality->reference ? ENVIRONMENT_SAMPLES_DEFAULT_REFERENCE : ENVIRONMENT_SAMPLES_DEFAULT;
}

/* Two directions across n: Duff et al. 2017, "Building an Orthonormal Basis, Revisited". */
static void find_frame(const double n[3], double x[3], double y[3])
{
    double sign = n[2] < 0 ? -1 : 1, a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    x[0] = 1 + sign * n[0] * n[0] * a, x[1] = sign * b, x[2] = -sign * n[0];
    y[0] = b, y[1] = sign + n[1] * n[1] * a, y[2] = -n[1];
}

static void to_world(const struct rt_ggx_lobe *lobe, const double local[3], double world[3])
{
    for (int k = 0; k < 3; k++)
        world[k] = local[0] * lobe->x[k] + local[1] * lobe->y[k] + local[2] * lobe->normal[k];
}

static void to_local(const struct rt_ggx_lobe *lobe, const double world[3], double local[3])
{
    local[0] = vec3_dot(lobe->x, world);
    local[1] = vec3_dot(lobe->y, world);
    local[2] = vec3_dot(lobe->normal, world);
}

void rt_ggx_lobe_init(struct rt_ggx_lobe *lobe, const double normal[3], const double view[3],
                      double alpha_square)
{
    memcpy(lobe->normal, normal, sizeof lobe->normal);
    find_frame(normal, lobe->x, lobe->y);
    to_local(lobe, view, lobe->view);
    lobe->view[2] = rt_max(lobe->view[2], 1e-4);
    vec3_normalize(lobe->view);
    lobe->alpha = sqrt(alpha_square);
}

/* Heitz 2018, appendix A: the visible normal is uniform on the half disk that the viewer sees of
 * the stretched hemisphere. h: along the lobe's axes. */
static void draw_normal(const struct rt_ggx_lobe *lobe, const double u[2], double h[3])
{
    const double *v = lobe->view;
    double stretched[3] = {lobe->alpha * v[0], lobe->alpha * v[1], v[2]}, t1[3], t2[3];
    vec3_normalize(stretched);
    double across = stretched[0] * stretched[0] + stretched[1] * stretched[1];
    double inverse = across > 0 ? 1 / sqrt(across) : 0;
    t1[0] = across > 0 ? -stretched[1] * inverse : 1;
    t1[1] = stretched[0] * inverse;
    t1[2] = 0;
    vec3_cross(stretched, t1, t2);
    double radius = sqrt(u[0]), phi = 2 * pi * u[1], s = 0.5 * (1 + stretched[2]);
    double p1 = radius * cos(phi), p2 = radius * sin(phi);
    p2 = (1 - s) * sqrt(rt_max(1 - p1 * p1, 0)) + s * p2;
    double p3 = sqrt(rt_max(1 - p1 * p1 - p2 * p2, 0));
    for (int k = 0; k < 3; k++)
        h[k] = p1 * t1[k] + p2 * t2[k] + p3 * stretched[k];
    h[0] *= lobe->alpha, h[1] *= lobe->alpha, h[2] = rt_max(h[2], 0);
    vec3_normalize(h);
}

void rt_ggx_lobe_normal(const struct rt_ggx_lobe *lobe, const double u[2], double normal[3])
{
    double h[3];
    draw_normal(lobe, u, h);
    to_world(lobe, h, normal);
}

/* l: the viewer's mirror image at a visible normal. False: that is below the surface. */
static bool lobe_draw(const struct rt_ggx_lobe *lobe, const double u[2], double l[3])
{
    const double *v = lobe->view;
    double h[3];
    draw_normal(lobe, u, h);
    double twice = 2 * vec3_dot(v, h);
    const double local[3] = {twice * h[0] - v[0], twice * h[1] - v[1], twice * h[2] - v[2]};
    to_world(lobe, local, l);
    return local[2] > 0;
}

/* Of l: that of the visible normal, D G1 (v.h) / (n.v), over 4 (v.h) (Heitz 2018, eq. 17). */
static double lobe_density(const struct rt_ggx_lobe *lobe, const double direction[3])
{
    double l[3], a2 = lobe->alpha * lobe->alpha, z = lobe->view[2];
    to_local(lobe, direction, l);
    if (l[2] <= 0)
        return 0;
    double h[3] = {l[0] + lobe->view[0], l[1] + lobe->view[1], l[2] + z};
    if (!vec3_normalize(h))
        return 0;
    double f = h[0] * h[0] + h[1] * h[1] + h[2] * h[2] * a2; /* 1 - z^2 leaves nothing of a sine */
    return a2 / (2 * pi * f * f * (z + sqrt(z * z * (1 - a2) + a2)));
}

static double largest(const double v[3])
{
    return rt_max(v[0], rt_max(v[1], v[2]));
}

/* Glass shows what is behind it, so that its lobe of transmitted light would show that twice. */
static void leave_out_transmission(struct rt_environment_sampler *sampler)
{
    struct rt_reflector *own = &sampler->own;
    *own = *sampler->reflector;
    for (int k = 0; k < 3; k++)
        own->through[k] = own->through_edge[k] = own->film.through[k] = 0;
    sampler->reflector = own;
}

void rt_environment_begin(struct rt_environment_sampler *sampler,
                          const struct environment_light *light,
                          const struct rt_reflector *reflector, uint32_t count, uint32_t seed)
{
    const struct rt_lobes *lobes = &reflector->lobes;
    double *share = sampler->share, c = 1 - reflector->n_dot_v, w = c * c * c * c * c, sum = 0;
    sampler->light = light;
    sampler->reflector = reflector;
    sampler->count = count;
    sampler->seed = seed;
    rt_ggx_lobe_init(&sampler->base, reflector->normal, reflector->view, reflector->alpha_square);
    share[SHARE_COSINE] = pi * largest(reflector->diffuse);
    if (lobes->has_sheen)
        share[SHARE_COSINE] += lobes->sheen_sent * largest(lobes->color);
    share[SHARE_BASE] = largest(reflector->specular) + w * largest(reflector->specular_edge);
    share[SHARE_COAT] = lobes->has_coat ? lobes->coat : 0;
    share[SHARE_BEHIND] = pi * largest(reflector->diffused);
    sampler->has_behind = share[SHARE_BEHIND] > 0;
    if (sampler->has_behind)
        leave_out_transmission(sampler);
    if (lobes->has_coat)
        rt_ggx_lobe_init(&sampler->coat, lobes->coat_normal, reflector->view,
                         lobes->coat_alpha_square);
    for (int i = 0; i < SHARE_COUNT; i++)
        sum += share[i];
    for (int i = 0; i < SHARE_COUNT; i++)
        share[i] = sum > 0 ? share[i] / sum : i == SHARE_COSINE;
}

/* The density with which a direction is drawn by the lobes alone [1/sr]. */
static double density_by_lobes(const struct rt_environment_sampler *sampler,
                               const double direction[3])
{
    const double *share = sampler->share, *normal = sampler->base.normal;
    double cosine = vec3_dot(normal, direction), density = 0;
    if (cosine < 0)
        return share[SHARE_BEHIND] * -cosine / pi;
    if (share[SHARE_COSINE] > 0)
        density += share[SHARE_COSINE] * cosine / pi;
    if (share[SHARE_BASE] > 0)
        density += share[SHARE_BASE] * lobe_density(&sampler->base, direction);
    if (share[SHARE_COAT] > 0)
        density += share[SHARE_COAT] * lobe_density(&sampler->coat, direction);
    return density;
}

/* The density of a visible normal's mirror image times what is masked on the light's side: Heitz
 * 2018, eq. 19. */
double rt_environment_mirrored(const struct rt_environment_sampler *sampler,
                               const double direction[3])
{
    double cosine = rt_max(vec3_dot(sampler->base.normal, direction), 0);
    double a2 = sampler->base.alpha * sampler->base.alpha;
    double masked = cosine + sqrt(cosine * cosine * (1 - a2) + a2);
    return lobe_density(&sampler->base, direction) * 2 * cosine / masked;
}

/* u[0] chooses the lobe, and is spread over its share again. False: no direction was drawn. */
static bool draw_by_lobes(const struct rt_environment_sampler *sampler, double u[2], double l[3])
{
    const double *share = sampler->share;
    int lobe = 0;
    for (int last = SHARE_COUNT - 1; lobe < last && u[0] >= share[lobe]; lobe++)
        u[0] -= share[lobe];
    while (lobe > 0 && share[lobe] <= 0)
        lobe--; /* by rounding behind the last one */
    u[0] = share[lobe] > 0 ? rt_min(u[0] / share[lobe], 1 - 0x1p-32) : u[0];
    if (lobe == SHARE_COAT)
        return lobe_draw(&sampler->coat, u, l);
    if (lobe == SHARE_BASE)
        return lobe_draw(&sampler->base, u, l);
    double radius = sqrt(u[0]), phi = 2 * pi * u[1]; /* Malley's method: a disk, lifted */
    double height = lobe == SHARE_BEHIND ? -sqrt(1 - u[0]) : sqrt(1 - u[0]);
    const double local[3] = {radius * cos(phi), radius * sin(phi), height};
    to_world(&sampler->base, local, l);
    return true;
}

bool rt_environment_draw(const struct rt_environment_sampler *sampler, uint32_t index,
                         double direction[3], double arriving[3])
{
    const uint32_t by_lobes = sampler->count / 2, by_map = sampler->count - by_lobes;
    const bool is_by_map = index % 2 == 0;
    double u[2], l[3], radiance[3], density;
    rt_sequence_point(index / 2, sampler->seed + (is_by_map ? 0 : 0x632be5abu), u);
    if (is_by_map) {
        density = environment_light_sample(sampler->light, u, l);
    } else {
        if (!draw_by_lobes(sampler, u, l))
            return false;
        density = environment_light_density(sampler->light, l);
    }
    if (vec3_dot(sampler->base.normal, l) <= 0 && !sampler->has_behind)
        return false;
    environment_light_radiance(sampler->light, l, radiance);
    density = by_map * density + by_lobes * density_by_lobes(sampler, l);
    if (!(density > 0) || !(largest(radiance) > 0))
        return false;
    memcpy(direction, l, sizeof l);
    for (int k = 0; k < 3; k++)
        arriving[k] = radiance[k] / density;
    return true;
}

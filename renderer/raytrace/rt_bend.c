/* SPDX-License-Identifier: MIT */
/* Refraction and total reflection of single rays. */
#include "renderer/raytrace/rt_bend.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_environment.h"

/* Half the spread of KHR_materials_dispersion, section "Dispersion": (n - 1) * 0.025 * dispersion
 * from one channel to the next, red bent least. */
static void spread_ior(struct rt_bend *bend, const struct scene_material *m)
{
    const double ior = (double)m->ior, half = (ior - 1) * 0.025 * (double)m->dispersion;
    bend->disperses = bend->kind >= STATE_BEND_SLAB && half > 0;
    for (int k = 0; k < RT_BEND_CHANNELS; k++)
        bend->ior[k] = rt_max(ior + (k - 1) * half, 1);
}

void rt_bend_init(struct rt_bend *bend, const struct rt_scene *scene, const struct rt_hit *hit,
                  const struct rt_surface *surface, const double way[3])
{
    const struct scene_material *m = surface->material;
    double roughness = state_bend_roughness((double)m->ior, surface->roughness);
    bend->kind = scene->meshes[hit->mesh].bend;
    bend->enters = hit->is_front;
    memcpy(bend->way, way, sizeof bend->way);
    vec3_normalize(bend->way);
    rt_scene_normal(scene, hit, bend->facet);
    memcpy(bend->normal, surface->normal, sizeof bend->normal);
    for (int k = 0; k < 3 && !hit->is_front; k++)
        bend->facet[k] = -bend->facet[k];
    if (vec3_dot(bend->normal, bend->way) >= 0) /* bent away from the viewer */
        memcpy(bend->normal, bend->facet, sizeof bend->normal);
    bend->alpha = roughness >= (double)STATE_BEND_ROUGHNESS_LEAST ? roughness * roughness : 0;
    bend->thickness_m = bend->kind == STATE_BEND_SLAB && hit->is_front ? surface->thickness_m : 0;
    spread_ior(bend, m);
}

static void mirror(const double way[3], const double normal[3], double out[3])
{
    double twice = 2 * vec3_dot(way, normal);
    for (int k = 0; k < 3; k++)
        out[k] = way[k] - twice * normal[k];
}

/* Snell's law; Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces", eq.
 * 40. eta: index of this side over that of the other. False: out is the total reflection. */
static bool refract(const double way[3], const double normal[3], double eta, double out[3])
{
    double c = -vec3_dot(way, normal), k2 = 1 - eta * eta * (1 - c * c);
    if (k2 < 0) {
        mirror(way, normal, out);
        return false;
    }
    for (int k = 0; k < 3; k++)
        out[k] = eta * way[k] + (eta * c - sqrt(k2)) * normal[k];
    return true;
}

/* Beside a bent normal the triangle decides: a ray that is to cross it does so. */
static bool cross_solid(const struct rt_bend *bend, const double normal[3], double eta,
                        double out[3])
{
    bool passes = refract(bend->way, normal, eta, out);
    double side = vec3_dot(out, bend->facet);
    if (passes ? side >= 0 : side <= 0)
        passes = refract(bend->way, bend->facet, eta, out);
    vec3_normalize(out);
    return passes;
}

static bool is_reflected_totally(const struct rt_bend *bend, const double normal[3], double ior)
{
    double cosine = vec3_dot(bend->way, normal);
    return ior * ior * (1 - cosine * cosine) > 1;
}

/* No ray is totally reflected at a bent normal where the triangle would let it through: the faces
 * of a thin wall are parallel, their bent normals are not, and would keep rays within the wall. */
static const double *leaving_normal(const struct rt_bend *bend, double ior)
{
    bool is_kept = bend->kind == STATE_BEND_SOLID && !bend->enters &&
                   is_reflected_totally(bend, bend->normal, ior) &&
                   !is_reflected_totally(bend, bend->facet, ior);
    return is_kept ? bend->facet : bend->normal;
}

/* How far a slab moves the ray across its direction: never farther than its thickness. */
static void find_shift(const struct rt_bend *bend, double ior, double shift[3])
{
    double inside[3];
    refract(bend->way, bend->facet, 1 / ior, inside);
    double length = bend->thickness_m / rt_max(-vec3_dot(inside, bend->facet), 1e-6);
    double along = vec3_dot(inside, bend->way) * length;
    for (int k = 0; k < 3; k++)
        shift[k] = inside[k] * length - bend->way[k] * along;
}

/* The mirrored lobe of KHR_materials_transmission: what a thin wall's front reflects, on the other
 * side of it. */
static void scatter_thin(const struct rt_bend *bend, const double normal[3], double out[3])
{
    mirror(bend->way, normal, out);
    if (vec3_dot(out, bend->normal) > 0)
        mirror(out, bend->normal, out);
    if (vec3_dot(out, bend->facet) >= 0)
        memcpy(out, bend->way, sizeof bend->way);
    vec3_normalize(out);
}

bool rt_bend_ray(const struct rt_bend *bend, int channel, const double u[2], double direction[3],
                 double shift[3])
{
    const double *mean = leaving_normal(bend, bend->ior[channel]);
    double normal[3];
    memcpy(normal, mean, sizeof normal);
    if (bend->alpha > 0) {
        const double view[3] = {-bend->way[0], -bend->way[1], -bend->way[2]};
        struct rt_ggx_lobe lobe;
        rt_ggx_lobe_init(&lobe, mean, view, bend->alpha * bend->alpha);
        rt_ggx_lobe_normal(&lobe, u, normal);
        if (vec3_dot(normal, bend->way) >= 0)
            memcpy(normal, mean, sizeof normal);
    }
    memset(shift, 0, 3 * sizeof *shift);
    if (bend->kind == STATE_BEND_SOLID) {
        double ior = bend->ior[channel];
        return cross_solid(bend, normal, bend->enters ? 1 / ior : ior, direction);
    }
    if (bend->thickness_m > 0)
        find_shift(bend, bend->ior[channel], shift);
    if (bend->alpha > 0)
        scatter_thin(bend, normal, direction);
    else
        memcpy(direction, bend->way, sizeof bend->way);
    return true;
}

/* SPDX-License-Identifier: MIT */
/* Filters and media along a ray. */
#include "renderer/raytrace/rt_path.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_grids.h"

void rt_media_at(const struct rt_scene *scene, const double point[3], struct rt_hits *scratch,
                 double sigma[3])
{
    sigma[0] = sigma[1] = sigma[2] = 0;
    if (!scene->state->medium_count)
        return;
    /* any direction gives the same; this one runs along no axis, plane or diagonal */
    struct rt_ray ray = {.direction = {0.3517, 0.8419, -0.4093},
                         .t_max = INFINITY,
                         .only_media = true,
                         .skip_mesh = UINT32_MAX,
                         .skip_triangle = UINT32_MAX};
    memcpy(ray.origin, point, sizeof ray.origin);
    rt_scene_collect(scene, &ray, scratch);
    for (size_t i = 0; i < scratch->count; i++)
        rt_media_cross(scene, &scratch->hits[i], sigma);
    for (int k = 0; k < 3; k++)
        sigma[k] = sigma[k] != 0 ? -sigma[k] : 0; /* all is left at infinity */
}

void rt_media_cross(const struct rt_scene *scene, const struct rt_hit *hit, double sigma[3])
{
    const struct state_item *item = scene->meshes[hit->mesh].item;
    const double *own = scene->state->materials[item->material].sigma;
    for (int k = 0; k < 3 && item->is_medium; k++)
        sigma[k] += hit->is_front ? own[k] : -own[k];
}

static void attenuate(const double sigma[3], double length_m, double through[3])
{
    for (int k = 0; k < 3; k++)
        if (sigma[k] > 0)
            through[k] *= exp(-sigma[k] * length_m);
}

void rt_media_pass(const double sigma[3], const struct rt_ray *ray, const double range[2],
                   double from, double to, double through[3])
{
    double length = fmin(to, range[1]) - fmax(from, range[0]);
    if (length > 0)
        attenuate(sigma, length * vec3_length(ray->direction), through);
}

void rt_filter_unseen(const struct rt_scene *scene, const struct rt_hit *hit,
                      const struct rt_footprint *footprint, const double direction[3],
                      double through[3])
{
    struct rt_surface surface;
    double filter[3];
    rt_surface_evaluate(scene, hit, footprint, &surface);
    double cosine = fabs(vec3_dot(surface.normal, direction)) / vec3_length(direction);
    rt_surface_light_filter(&surface, cosine, false, VIEW_BLEND_COVERAGE, filter);
    for (int k = 0; k < 3; k++)
        through[k] *= filter[k] * (1 - surface.alpha * surface.metallic);
}

uint32_t rt_path_excluded_node(const struct rt_scene *scene, const struct rt_hit *on)
{
    const struct rt_mesh *mesh = &scene->meshes[on->mesh];
    return mesh->no_self_shadow ? mesh->node + 1 : 0;
}

bool rt_path_is_excluded(const struct rt_scene *scene, const struct rt_ray *ray,
                         const struct rt_hit *hit)
{
    return ray->excluded_node && scene->meshes[hit->mesh].node + 1 == ray->excluded_node;
}

/* Clipped away, or a hole of the mask. */
static bool is_no_filter(const struct rt_scene *scene, const struct rt_hit *hit)
{
    return hit->is_hidden || scene->meshes[hit->mesh].class_ == STATE_MASKED;
}

/* Whether the filter before this one, as light comes, is of the same node, which casts once. */
static bool is_repeated(const struct rt_scene *scene, const struct rt_hits *hits, size_t i)
{
    const struct rt_mesh *mesh = &scene->meshes[hits->hits[i].mesh], *before;
    if (!mesh->cast_once)
        return false;
    do
        if (++i == hits->count)
            return false;
    while (is_no_filter(scene, &hits->hits[i]));
    before = &scene->meshes[hits->hits[i].mesh];
    return before->node == mesh->node && before->cast_once;
}

/* What the light on the ray loses to one surface. */
static void cross_filter(const struct rt_scene *scene, const struct rt_hit *hit,
                         const struct rt_ray *ray, enum view_blend_filter blend, double out[3])
{
    const struct rt_mesh *mesh = &scene->meshes[hit->mesh];
    struct rt_surface surface;
    double own[3], normal[3];
    const double *filter = mesh->filter;
    if (!mesh->is_filter_plain) {
        rt_surface_evaluate_filter(scene, hit, &surface);
        rt_scene_normal(scene, hit, normal);
        /* the light comes from the far end of this ray: it enters where the ray sees the back */
        rt_surface_light_filter(&surface, fabs(vec3_dot(normal, ray->direction)), !hit->is_front,
                                blend, own);
        filter = own;
    }
    for (int k = 0; k < 3; k++)
        out[k] *= filter[k];
}

static void pass_grids(const struct rt_scene *scene, const struct rt_ray *ray, double out[3])
{
    double range[2];
    rt_scene_kept_range(scene, ray, range);
    rt_grids_pass(scene, ray, range, 0, ray->t_max, out);
}

static bool is_filter(const struct rt_scene *scene, const struct rt_hits *hits, size_t i)
{
    return !is_no_filter(scene, &hits->hits[i]) && !is_repeated(scene, hits, i);
}

static void path_through_media(const struct rt_scene *scene, const struct rt_hits *hits,
                               const struct rt_ray *ray, const double sigma_end[3],
                               enum view_blend_filter blend, double out[3])
{
    double sigma[3] = {0}, range[2], t = 0;
    rt_scene_kept_range(scene, ray, range);
    for (size_t i = 0; i < hits->count; i++)
        if (!rt_path_is_excluded(scene, ray, &hits->hits[i]))
            rt_media_cross(scene, &hits->hits[i], sigma);
    for (int k = 0; k < 3; k++)
        sigma[k] = sigma_end[k] - sigma[k]; /* at the point, from what holds at the light */
    for (size_t i = 0; i < hits->count; i++) {
        const struct rt_hit *hit = &hits->hits[i];
        if (rt_path_is_excluded(scene, ray, hit))
            continue;
        rt_media_pass(sigma, ray, range, t, hit->t, out);
        rt_media_cross(scene, hit, sigma);
        t = hit->t;
        if (is_filter(scene, hits, i))
            cross_filter(scene, hit, ray, blend, out);
    }
    if (ray->t_max < INFINITY)
        rt_media_pass(sigma, ray, range, t, ray->t_max, out);
}

void rt_path_transmittance(const struct rt_scene *scene, const struct rt_hits *hits,
                           const struct rt_ray *ray, const double sigma_end[3],
                           enum view_blend_filter blend, double out[3])
{
    out[0] = out[1] = out[2] = 1;
    if (scene->state->grid_count)
        pass_grids(scene, ray, out);
    if (scene->state->medium_count) {
        path_through_media(scene, hits, ray, sigma_end, blend, out);
        return;
    }
    for (size_t i = 0; i < hits->count; i++)
        if (!rt_path_is_excluded(scene, ray, &hits->hits[i]) && is_filter(scene, hits, i))
            cross_filter(scene, &hits->hits[i], ray, blend, out);
}

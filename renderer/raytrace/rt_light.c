/* SPDX-License-Identifier: MIT */
/* Shadow rays of the ground truth, and the sum over all lights. */
#include "renderer/raytrace/rt_light.h"

#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_environment.h"
#include "renderer/raytrace/rt_haze.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_reflect.h"
#include "renderer/raytrace/rt_terminator.h"
#include "renderer/scene/ground_plane.h"

bool rt_lighting_init(struct rt_lighting *lighting, const struct rt_scene *scene,
                      const struct view *view, struct error *err)
{
    *lighting = (struct rt_lighting){.scene = scene, .view = view};
    return rt_grid_lines_init(&lighting->grids, scene->state, err) &&
           rt_hits_init(&lighting->shadow_hits, err);
}

void rt_lighting_finish(struct rt_lighting *lighting)
{
    rt_hits_finish(&lighting->shadow_hits);
    rt_grid_lines_finish(&lighting->grids);
    *lighting = (struct rt_lighting){0};
}

void rt_shadow_ray(const struct rt_scene *scene, const struct rt_arrival *arrival,
                   const double point[3], const struct rt_hit *on, struct rt_ray *ray)
{
    *ray = (struct rt_ray){.skip_mesh = on ? on->mesh : UINT32_MAX,
                           .skip_triangle = on ? on->triangle : UINT32_MAX,
                           .excluded_node = on ? rt_path_excluded_node(scene, on) : 0};
    memcpy(ray->origin, point, sizeof ray->origin);
    memcpy(ray->direction, arrival->direction, sizeof ray->direction);
    rt_shadow_range(scene, arrival->distance_m, ray);
}

void rt_light_media(const struct rt_scene *scene, const struct rt_arrival *arrival,
                    const double point[3], struct rt_hits *scratch, double sigma[3])
{
    double at[3];
    sigma[0] = sigma[1] = sigma[2] = 0;
    if (!scene->state->medium_count || !isfinite(arrival->distance_m))
        return;
    for (int k = 0; k < 3; k++)
        at[k] = point[k] + arrival->direction[k] * arrival->distance_m;
    rt_media_at(scene, at, scratch, sigma);
}

/* To the side that sends light to the viewer; on the other one the mesh is in its own shadow. */
static void leave_smooth_surface(const struct rt_scene *scene, const struct rt_hit *on,
                                 struct rt_ray *ray)
{
    struct rt_smooth_start start;
    if (!on || !on->is_opaque || !rt_terminator_find(scene, on, ray->origin, &start) ||
        vec3_dot(start.normal, ray->direction) <= 0)
        return;
    for (int k = 0; k < 3; k++)
        ray->origin[k] += start.offset[k];
}

void rt_transmittance(struct rt_lighting *lighting, const struct rt_arrival *arrival,
                      const double point[3], const struct rt_hit *on, double out[3])
{
    const struct rt_scene *scene = lighting->scene;
    struct rt_hits *hits = &lighting->shadow_hits;
    struct rt_ray ray;
    double sigma[3];
    rt_light_media(scene, arrival, point, hits, sigma);
    rt_shadow_ray(scene, arrival, point, on, &ray);
    leave_smooth_surface(scene, on, &ray);
    rt_scene_collect(scene, &ray, hits);
    lighting->shadow_rays++;
    lighting->has_overflowed |= hits->has_overflowed;
    const struct rt_hit *last = hits->count ? &hits->hits[hits->count - 1] : NULL;
    if (last && last->is_opaque)
        out[0] = out[1] = out[2] = 0;
    else
        rt_path_transmittance(scene, hits, &ray, sigma, lighting->view->quality.blend_filter, out);
}

static bool casts_shadows(const struct rt_lighting *lighting)
{
    return !lighting->is_unshadowed && lighting->view->quality.shadows != SHADOWS_NONE;
}

/* Adds the light of one sample. */
static void add_arrival(struct rt_lighting *lighting, const struct state_light *light,
                        const struct rt_arrival *arrival, const struct rt_hit *hit,
                        const struct rt_reflector *reflector, const double point[3], double out[3])
{
    double reflected[3], transmittance[3] = {1, 1, 1};
    if (arrival->gain <= 0 || !rt_reflect(reflector, arrival->direction, reflected))
        return;
    if (light->casts_shadow && casts_shadows(lighting))
        rt_transmittance(lighting, arrival, point, hit, transmittance);
    double gain = arrival->gain * rt_haze_arrives(lighting->scene, lighting->view, arrival, point);
    for (int k = 0; k < 3; k++)
        out[k] += reflected[k] * transmittance[k] * gain * (double)light->color[k];
}

static void add_environment(struct rt_lighting *lighting, const struct rt_hit *hit,
                            const struct rt_reflector *reflector, const double point[3],
                            double out[3])
{
    const struct view_quality *quality = &lighting->view->quality;
    struct rt_environment_sampler sampler;
    uint32_t count = rt_environment_count(lighting->environment, quality);
    if (!count)
        return;
    rt_environment_begin(&sampler, lighting->environment, reflector, count,
                         lighting->seed + (uint32_t)lighting->scene->state->light_count);
    for (uint32_t i = 0; i < count; i++) {
        struct rt_arrival arrival = {.distance_m = INFINITY, .gain = 1};
        double arriving[3], reflected[3], transmittance[3] = {1, 1, 1};
        if (!rt_environment_draw(&sampler, i, arrival.direction, arriving) ||
            !rt_reflect(sampler.reflector, arrival.direction, reflected))
            continue;
        if (casts_shadows(lighting))
            rt_transmittance(lighting, &arrival, point, hit, transmittance);
        for (int k = 0; k < 3; k++)
            out[k] += reflected[k] * transmittance[k] * arriving[k];
    }
}

void rt_radiance(struct rt_lighting *lighting, const struct rt_hit *hit,
                 const struct rt_surface *surface, const double point[3], const double view[3],
                 double out[3])
{
    const struct scene_state *state = lighting->scene->state;
    if (surface->material->flags & SCENE_MATERIAL_UNLIT) {
        for (int k = 0; k < 3; k++)
            out[k] = surface->base[k] + surface->emissive[k];
        return;
    }
    struct rt_reflector reflector;
    rt_reflector_init(&reflector, surface, view);
    rt_reflector_emission(&reflector, surface, out);
    if (state->has_environment)
        rt_reflect_hemisphere(state, &reflector, surface, out);
    for (size_t i = 0; i < state->light_count; i++) {
        const struct state_light *light = &state->lights[i];
        struct rt_light_sample sample = {.count =
                                             rt_light_sample_count(light, &lighting->view->quality),
                                         .seed = lighting->seed + (uint32_t)i};
        for (; sample.index < sample.count; sample.index++) {
            struct rt_arrival arrival;
            rt_light_arrive(light, &sample, lighting->scene->origin, point, &arrival);
            add_arrival(lighting, light, &arrival, hit, &reflector, point, out);
        }
    }
    add_environment(lighting, hit, &reflector, point, out);
}

void rt_ground_share(const struct rt_scene *scene, const double point[3], const double arriving[3],
                     const double unshadowed[3], double filter[3])
{
    double from_center[3];
    for (int k = 0; k < 3; k++)
        from_center[k] = point[k] + scene->origin[k] - scene->state->ground_plane.center[k];
    ground_plane_filter(scene->state, vec3_length(from_center), arriving, unshadowed, filter);
}

void rt_ground_filter(struct rt_lighting *lighting, const struct rt_hit *hit,
                      const struct rt_surface *surface, const double point[3], const double view[3],
                      double filter[3])
{
    double arriving[3], unshadowed[3];
    rt_radiance(lighting, hit, surface, point, view, arriving);
    lighting->is_unshadowed = true;
    rt_radiance(lighting, hit, surface, point, view, unshadowed);
    lighting->is_unshadowed = false;
    rt_ground_share(lighting->scene, point, arriving, unshadowed, filter);
}

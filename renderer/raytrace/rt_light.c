/* SPDX-License-Identifier: MIT */
/* Shadow rays of the ground truth, and the sum over all lights. */
#include "renderer/raytrace/rt_light.h"

#include <stdlib.h>

#include "renderer/raytrace/rt_reflect.h"
#include "renderer/scene/matrix.h"

bool rt_lighting_init(struct rt_lighting *lighting, const struct rt_scene *scene,
                      const struct view *view, struct error *err)
{
    *lighting = (struct rt_lighting){.scene = scene, .view = view};
    lighting->shadow_hits.hits = calloc(RT_HITS_MAX, sizeof *lighting->shadow_hits.hits);
    if (!lighting->shadow_hits.hits)
        return error_set(err, ERROR_NO_MEMORY, "hits of a shadow ray");
    return true;
}

void rt_lighting_finish(struct rt_lighting *lighting)
{
    free(lighting->shadow_hits.hits);
    *lighting = (struct rt_lighting){0};
}

void rt_transmittance(struct rt_lighting *lighting, const struct rt_arrival *arrival,
                      const double point[3], const struct rt_hit *on, double out[3])
{
    const struct rt_scene *scene = lighting->scene;
    struct rt_ray ray = {.skip_mesh = on ? on->mesh : UINT32_MAX,
                         .skip_triangle = on ? on->triangle : UINT32_MAX};
    out[0] = out[1] = out[2] = 1;
    memcpy(ray.origin, point, sizeof ray.origin);
    memcpy(ray.direction, arrival->direction, sizeof ray.direction);
    double distance = arrival->distance_m, diagonal[3];
    vec3_sub(scene->state->bounds_max, scene->state->bounds_min, diagonal);
    ray.t_max = isfinite(distance) ? distance : 4 * vec3_length(diagonal);
    ray.t_min = scene->epsilon * ray.t_max;
    rt_scene_collect(scene, &ray, &lighting->shadow_hits);
    lighting->shadow_rays++;
    lighting->has_overflowed |= lighting->shadow_hits.has_overflowed;
    for (size_t i = 0; i < lighting->shadow_hits.count; i++) {
        const struct rt_hit *hit = &lighting->shadow_hits.hits[i];
        if (rt_scene_is_opaque(scene, hit)) {
            out[0] = out[1] = out[2] = 0;
            return;
        }
        if (scene->meshes[hit->mesh].item->class_ == STATE_MASKED)
            continue; /* a hole of the mask */
        struct rt_surface surface;
        double filter[3];
        rt_surface_evaluate(scene, hit, &surface);
        /* the light comes from the far end of this ray: it enters where the ray sees the back */
        rt_surface_light_filter(&surface, fabs(vec3_dot(hit->normal, ray.direction)),
                                !hit->is_front, lighting->view->quality.blend_filter, filter);
        for (int k = 0; k < 3; k++)
            out[k] *= filter[k];
    }
}

/* Adds the light of one sample. */
static void add_arrival(struct rt_lighting *lighting, const struct state_light *light,
                        const struct rt_arrival *arrival, const struct rt_hit *hit,
                        const struct rt_surface *surface, const double point[3],
                        const double view[3], double out[3])
{
    double reflected[3], transmittance[3] = {1, 1, 1};
    if (arrival->gain <= 0)
        return;
    rt_reflect(surface, view, arrival->direction, reflected);
    if (reflected[0] <= 0 && reflected[1] <= 0 && reflected[2] <= 0)
        return;
    if (light->casts_shadow && lighting->view->quality.shadows != VIEW_SHADOWS_NONE)
        rt_transmittance(lighting, arrival, point, hit, transmittance);
    for (int k = 0; k < 3; k++)
        out[k] += reflected[k] * transmittance[k] * arrival->gain * (double)light->color[k];
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
    memcpy(out, surface->emissive, 3 * sizeof *out);
    if (state->has_environment)
        rt_reflect_hemisphere(state, surface, view, out);
    for (size_t i = 0; i < state->light_count; i++) {
        const struct state_light *light = &state->lights[i];
        struct rt_light_sample sample = {.count =
                                             rt_light_sample_count(light, &lighting->view->quality),
                                         .seed = lighting->seed + (uint32_t)i};
        for (; sample.index < sample.count; sample.index++) {
            struct rt_arrival arrival;
            rt_light_arrive(light, &sample, lighting->scene->origin, point, &arrival);
            add_arrival(lighting, light, &arrival, hit, surface, point, view, out);
        }
    }
}

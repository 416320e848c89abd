/* SPDX-License-Identifier: MIT */
/* Rays from points of the scene to its lights, by the functions that pictures call. */
#include "tests/support/raytrace_probe.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_light.h"
#include "renderer/raytrace/rt_scene.h"
#include "tests/support/area_integral.h"

/* Mean over the light's area. */
static void probe_light(struct rt_lighting *lighting, const struct state_light *light,
                        const double point[3], double out[3])
{
    struct rt_light_sample sample = {
        .count = rt_light_sample_count(light, &lighting->view->quality), .seed = lighting->seed};
    out[0] = out[1] = out[2] = light->casts_shadow ? 0 : 1;
    for (; light->casts_shadow && sample.index < sample.count; sample.index++) {
        struct rt_arrival arrival;
        double t[3];
        rt_light_arrive(light, &sample, lighting->scene->origin, point, &arrival);
        rt_transmittance(lighting, &arrival, point, NULL, t);
        for (int k = 0; k < 3; k++)
            out[k] += t[k] / sample.count;
    }
}

bool raytrace_probe(const struct raytrace_probe_desc *desc, double (*out)[3], struct error *err)
{
    struct rt_scene scene;
    struct rt_lighting lighting = {0};
    if (!rt_scene_init(&scene, desc->state, desc->view, err))
        return false;
    bool ok = rt_lighting_init(&lighting, &scene, desc->view, err);
    for (size_t i = 0; ok && i < desc->state->light_count; i++) {
        for (size_t p = 0; p < desc->point_count; p++) {
            double point[3];
            vec3_sub(desc->points[p], scene.origin, point);
            lighting.seed = (uint32_t)p;
            const struct state_light *light = &desc->state->lights[i];
            double *t = out[i * desc->point_count + p];
            if (desc->follows_edges && state_light_is_area(light) && light->casts_shadow)
                area_integral_transmittance(&lighting, light, point,
                                            rt_light_sample_count(light, &desc->view->quality), t);
            else
                probe_light(&lighting, light, point, t);
        }
    }
    if (ok && lighting.has_overflowed)
        ok = error_set(err, ERROR_OVER_BUDGET, "a ray meets more than %d surfaces", RT_HITS_MAX);
    if (desc->shadow_rays)
        *desc->shadow_rays = lighting.shadow_rays;
    rt_lighting_finish(&lighting);
    rt_scene_finish(&scene);
    return ok;
}

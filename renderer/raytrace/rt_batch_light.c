/* SPDX-License-Identifier: MIT */
/* Asking lights for a batch of surfaces; shadow rays go to one light in packets. */
#include "renderer/raytrace/rt_batch_light.h"

#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_light.h"
#include "renderer/raytrace/rt_math.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_reflect.h"
#include "renderer/scene/matrix.h"

static void add_light(struct rt_fragment *fragment, const struct rt_ray_job *job,
                      const double transmittance[3])
{
    for (int k = 0; k < 3; k++)
        fragment->radiance[k] += (double)job->weight[k] * transmittance[k];
}

/* From just off the surface on the light's side to just before the light: f32 may misplace both,
 * and a caster that the light touches, by nudge_m. */
static void place_ray(const struct rt_batch *batch, const struct rt_ray_job *job,
                      struct rt_ray *ray)
{
    const struct rt_fragment *fragment = &batch->fragments[job->fragment];
    const double *normal = fragment->normal;
    struct rt_arrival arrival = {.distance_m = (double)job->distance_m};
    for (int k = 0; k < 3; k++)
        arrival.direction[k] = (double)job->direction[k];
    rt_shadow_ray(batch->desc.scene, &arrival, fragment->point, &fragment->hit, ray);
    double nudge = batch->desc.scene->nudge_m;
    if (isfinite(job->distance_m))
        ray->t_max = rt_max(ray->t_max - 8 * nudge, ray->t_min);
    if (vec3_dot(normal, arrival.direction) < 0)
        nudge = -nudge;
    for (int k = 0; k < 3; k++)
        ray->origin[k] += normal[k] * nudge;
}

static void light_media(struct rt_batch *batch, const struct rt_ray_job *job, double sigma[3])
{
    const struct rt_lamps *lamps = batch->desc.lamps;
    if (lamps->sigma && lamps->lamps[job->light].samples == 1) {
        memcpy(sigma, lamps->sigma[job->light], 3 * sizeof *sigma);
        return;
    }
    struct rt_arrival arrival = {.distance_m = (double)job->distance_m};
    for (int k = 0; k < 3; k++)
        arrival.direction[k] = (double)job->direction[k];
    rt_light_media(batch->desc.scene, &arrival, batch->fragments[job->fragment].point,
                   &batch->scratch, sigma);
}

static void trace_jobs(struct rt_batch *batch, const struct rt_ray_job *jobs, size_t count)
{
    struct rt_packet *packet = &batch->packet;
    packet->count = (int)count;
    for (size_t i = 0; i < count; i++)
        place_ray(batch, &jobs[i], &packet->rays[i]);
    rt_packet_occlude(packet);
    for (size_t i = 0; i < count; i++) {
        const struct rt_hits *hits = &packet->hits[i];
        double transmittance[3] = {1, 1, 1}, sigma[3];
        batch->has_overflowed |= hits->has_overflowed;
        if (packet->is_occluded[i])
            continue;
        if (hits->count || batch->desc.scene->state->medium_count) {
            light_media(batch, &jobs[i], sigma);
            rt_path_transmittance(batch->desc.scene, hits, &packet->rays[i], sigma,
                                  batch->desc.view->quality.blend_filter, transmittance);
        }
        add_light(&batch->fragments[jobs[i].fragment], &jobs[i], transmittance);
    }
    batch->shadow_rays += count;
}

/* Jobs sorted by light, in the order of their surfaces: neighbours go together. */
static void flush_jobs(struct rt_batch *batch)
{
    size_t lights = batch->desc.scene->state->light_count;
    uint32_t *counts = batch->light_counts, first = 0;
    for (size_t i = 0; i < lights; i++) {
        uint32_t count = counts[i];
        counts[i] = first;
        first += count;
    }
    for (size_t i = 0; i < batch->job_count; i++)
        batch->sorted[counts[batch->jobs[i].light]++] = batch->jobs[i];
    batch->is_cancelled = rt_job_is_cancelled(batch->desc.job);
    for (size_t i = 0; i < batch->job_count && !batch->is_cancelled;) {
        size_t end = i + 1;
        while (end < batch->job_count && end - i < RT_LANES &&
               batch->sorted[end].light == batch->sorted[i].light)
            end++;
        trace_jobs(batch, &batch->sorted[i], end - i);
        i = end;
    }
    memset(counts, 0, lights * sizeof *counts);
    batch->job_count = 0;
}

/* What the light adds to the surface, at once or after its shadow ray. */
static void ask(struct rt_batch *batch, uint32_t index, const struct rt_ray_job *arriving,
                double gain)
{
    struct rt_fragment *fragment = &batch->fragments[index];
    const struct state_light *light = &batch->desc.scene->state->lights[arriving->light];
    struct rt_ray_job job = *arriving;
    double l[3] = {(double)job.direction[0], (double)job.direction[1], (double)job.direction[2]};
    double reflected[3];
    rt_reflect(&fragment->surface, fragment->view, l, reflected);
    if (reflected[0] <= 0 && reflected[1] <= 0 && reflected[2] <= 0)
        return;
    for (int k = 0; k < 3; k++)
        job.weight[k] = (float)(reflected[k] * gain * (double)light->color[k]);
    if (!light->casts_shadow || batch->desc.view->quality.shadows == VIEW_SHADOWS_NONE) {
        add_light(fragment, &job, (const double[3]){1, 1, 1});
        return;
    }
    if (batch->job_count == RT_BATCH_JOBS_MAX)
        flush_jobs(batch);
    batch->jobs[batch->job_count++] = job;
    batch->light_counts[job.light]++;
}

static void ask_area(struct rt_batch *batch, uint32_t index, uint32_t light)
{
    const struct rt_fragment *fragment = &batch->fragments[index];
    struct rt_light_sample sample = {.count = batch->desc.lamps->lamps[light].samples,
                                     .seed = rt_job_seed(fragment->x, fragment->y, 0) + light};
    for (; sample.index < sample.count; sample.index++) {
        struct rt_arrival arrival;
        rt_light_arrive(&batch->desc.scene->state->lights[light], &sample,
                        batch->desc.scene->origin, fragment->point, &arrival);
        struct rt_ray_job job = {
            .fragment = index, .light = light, .distance_m = (float)arrival.distance_m};
        for (int k = 0; k < 3; k++)
            job.direction[k] = (float)arrival.direction[k];
        if (arrival.gain > 0)
            ask(batch, index, &job, arrival.gain);
    }
}

static void ask_lights(struct rt_batch *batch, uint32_t index)
{
    const struct rt_fragment *fragment = &batch->fragments[index];
    const struct rt_lamps *lamps = batch->desc.lamps;
    struct rt_lamp_list list = rt_lamps_near(lamps, fragment->x, fragment->y, fragment->view_z);
    float point[3] = {(float)fragment->point[0], (float)fragment->point[1],
                      (float)fragment->point[2]};
    batch->surfaces++;
    batch->lights_listed += list.counts[0] + list.counts[1];
    for (int run = 0; run < 2; run++) {
        for (size_t i = 0; i < list.counts[run]; i++) {
            uint32_t light = list.items[run][i];
            if (lamps->lamps[light].is_area) {
                batch->lights_reaching++;
                ask_area(batch, index, light);
                continue;
            }
            struct rt_ray_job job = {.fragment = index, .light = light};
            float gain = rt_lamp_arrive(lamps, light, point, job.direction, &job.distance_m);
            if (gain <= 0)
                continue;
            batch->lights_reaching++;
            ask(batch, index, &job, (double)gain);
        }
    }
}

/* Of a sampler without levels of detail one sample of a texture that is finer than the pixel would
 * flicker. */
static void average_base(const struct rt_scene *scene, struct rt_fragment *fragment)
{
    struct rt_surface *surface = &fragment->surface;
    int32_t texture = surface->material->textures[SCENE_TEXTURE_BASE_COLOR].texture;
    double sum[4] = {surface->base[0], surface->base[1], surface->base[2], surface->alpha};
    if (texture < 0 || rt_texture_has_levels(&scene->state->scene->textures[texture]))
        return;
    for (int i = 0; i < fragment->texel_count; i++) {
        const struct rt_hit hit = {.mesh = fragment->hit.mesh,
                                   .triangle = fragment->texels[i].triangle,
                                   .u = (double)fragment->texels[i].u,
                                   .v = (double)fragment->texels[i].v};
        double base[4];
        rt_surface_base(scene, &hit, &fragment->footprint, base);
        for (int k = 0; k < 4; k++)
            sum[k] += base[k];
    }
    for (int k = 0; k < 3; k++)
        surface->base[k] = sum[k] / (fragment->texel_count + 1);
    if (surface->material->alpha_mode == SCENE_BLEND)
        surface->alpha = sum[3] / (fragment->texel_count + 1);
}

static void begin_fragment(struct rt_batch *batch, uint32_t index)
{
    struct rt_fragment *fragment = &batch->fragments[index];
    struct rt_surface *surface = &fragment->surface;
    const struct scene_state *state = batch->desc.scene->state;
    rt_surface_evaluate(batch->desc.scene, &fragment->hit, &fragment->footprint, surface);
    average_base(batch->desc.scene, fragment);
    if (fragment->is_opaque)
        surface->alpha = 1, surface->transmission = 0;
    else
        rt_surface_view_filter(surface, fabs(vec3_dot(surface->normal, fragment->view)),
                               fragment->hit.is_front, fragment->filter);
    memcpy(fragment->radiance, surface->emissive, sizeof fragment->radiance);
    if (surface->material->flags & SCENE_MATERIAL_UNLIT) {
        for (int k = 0; k < 3; k++)
            fragment->radiance[k] += surface->base[k];
        return;
    }
    if (state->has_environment)
        rt_reflect_hemisphere(state, surface, fragment->view, fragment->radiance);
    ask_lights(batch, index);
}

void rt_batch_light(struct rt_batch *batch)
{
    for (uint32_t i = 0; i < batch->fragment_count && !batch->is_cancelled; i++) {
        begin_fragment(batch, i);
    }
    flush_jobs(batch);
}

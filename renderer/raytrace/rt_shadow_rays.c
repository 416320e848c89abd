/* SPDX-License-Identifier: MIT */
/* Shadow rays in packets to one light. */
#include "renderer/raytrace/rt_shadow_rays.h"

#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_light.h"
#include "renderer/raytrace/rt_path.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum { JOBS_MAX = 16384 }; /* 1 MB */

static const double LEAP_MAX = 20; /* offsets are mostly a tenth of a pixel */

bool rt_shadow_rays_init(struct rt_shadow_rays *rays, const struct rt_scene *scene,
                         const struct rt_light_set *light_set, enum view_blend_filter blend,
                         struct error *err)
{
    rays->scene = scene;
    rays->light_set = light_set;
    rays->blend = blend;
    rays->jobs = calloc(JOBS_MAX, sizeof *rays->jobs);
    rays->sorted = calloc(JOBS_MAX, sizeof *rays->sorted);
    rays->light_counts = calloc(scene->state->light_count + 1, sizeof *rays->light_counts);
    if (!rays->jobs || !rays->sorted || !rays->light_counts)
        return error_set(err, ERROR_NO_MEMORY, "%d waiting shadow rays", JOBS_MAX);
    return rt_packet_init(&rays->packet, scene, err) && rt_hits_init(&rays->scratch, err);
}

void rt_shadow_rays_finish(struct rt_shadow_rays *rays)
{
    free(rays->jobs);
    free(rays->sorted);
    free(rays->light_counts);
    rt_packet_finish(&rays->packet);
    rt_hits_finish(&rays->scratch);
    *rays = (struct rt_shadow_rays){0};
}

static struct rt_arrival job_arrival(const struct rt_shadow_job *job)
{
    struct rt_arrival arrival = {.distance_m = (double)job->distance_m};
    for (int k = 0; k < 3; k++)
        arrival.direction[k] = (double)job->direction[k];
    return arrival;
}

/* How a ray gets off the surface that it starts on: along itself, and where that were far, along
 * the normal. */
struct leap {
    double along_ray_m, along_normal_m;
};

static struct leap choose_leap(const struct rt_shadow_job *job)
{
    double cosine = 0, offset = (double)job->offset_m;
    for (int k = 0; k < 3; k++)
        cosine += (double)job->normal[k] * (double)job->direction[k];
    double way = offset / fmax(fabs(cosine), 1 / LEAP_MAX);
    double rest = offset - way * fabs(cosine);
    return (struct leap){way, cosine < 0 ? -rest : rest};
}

/* From off the surface on the light's side to just before the light, as production has it. */
static void place_ray(const struct rt_scene *scene, const struct rt_shadow_job *job,
                      struct rt_ray *ray)
{
    struct rt_arrival arrival = job_arrival(job);
    struct leap leap = choose_leap(job);
    rt_shadow_ray(scene, &arrival, job->point, NULL, ray);
    ray->excluded_node = job->excluded_node;
    ray->skip_mesh = job->skip_mesh;
    ray->skip_triangle = job->skip_triangle;
    ray->t_max -= leap.along_ray_m;
    if (isfinite(job->distance_m))
        ray->t_max -= 8 * scene->nudge_m;
    ray->t_max = fmax(ray->t_max, ray->t_min);
    for (int k = 0; k < 3; k++)
        ray->origin[k] +=
            (double)job->normal[k] * leap.along_normal_m + ray->direction[k] * leap.along_ray_m;
}

static void light_media(struct rt_shadow_rays *rays, const struct rt_shadow_job *job,
                        double sigma[3])
{
    const struct rt_light_set *light_set = rays->light_set;
    struct rt_arrival arrival = job_arrival(job);
    if (!isfinite(job->distance_m)) { /* no medium ends there */
        sigma[0] = sigma[1] = sigma[2] = 0;
        return;
    }
    if (light_set->sigma && light_set->records[job->light].samples == 1) {
        memcpy(sigma, light_set->sigma[job->light], 3 * sizeof *sigma);
        return;
    }
    rt_light_media(rays->scene, &arrival, job->point, &rays->scratch, sigma);
}

/* What media take on the way that the leap leaves out. */
static void attenuate_leap(const struct rt_shadow_rays *rays, const struct rt_shadow_job *job,
                           const struct rt_ray *ray, const struct rt_hits *hits,
                           const double sigma_end[3], double transmittance[3])
{
    double crossed[3] = {0}, sigma[3], range[2];
    rt_scene_kept_range(rays->scene, ray, range);
    for (size_t i = 0; i < hits->count; i++)
        if (!rt_path_is_excluded(rays->scene, ray, &hits->hits[i]))
            rt_media_cross(rays->scene, &hits->hits[i], crossed);
    for (int k = 0; k < 3; k++)
        sigma[k] = sigma_end[k] - crossed[k];
    rt_media_pass(sigma, ray, range, -choose_leap(job).along_ray_m, 0, transmittance);
}

void rt_shadow_pack(const double t[3], uint32_t words[2])
{
    double largest = fmax(t[0], fmax(t[1], t[2]));
    int exponent;
    words[0] = words[1] = 0;
    if (!(largest > 0))
        return;
    frexp(largest, &exponent);
    if (rint(ldexp(largest, TRACED_FILTER_BITS - exponent)) >= ldexp(1, TRACED_FILTER_BITS))
        exponent++; /* the largest rounds up to the next power of two */
    int e = 1 - exponent;
    e = e > TRACED_EXPONENT_MAX ? TRACED_EXPONENT_MAX : e;
    uint64_t packed = (uint64_t)e << (3 * TRACED_FILTER_BITS);
    for (int k = 0; k < 3; k++)
        packed |= (uint64_t)rint(ldexp(fmax(t[k], 0), TRACED_FILTER_BITS - 1 + e))
                  << (k * TRACED_FILTER_BITS);
    words[0] = (uint32_t)packed;
    words[1] = (uint32_t)(packed >> 32);
}

void rt_shadow_rays_trace(struct rt_shadow_rays *rays, const struct rt_shadow_job *jobs,
                          size_t count, double (*passed)[3])
{
    struct rt_packet *packet = &rays->packet;
    packet->count = (int)count;
    for (size_t i = 0; i < count; i++)
        place_ray(rays->scene, &jobs[i], &packet->rays[i]);
    rt_packet_occlude(packet);
    for (size_t i = 0; i < count; i++) {
        const struct rt_hits *hits = &packet->hits[i];
        double *transmittance = passed[i], sigma[3];
        transmittance[0] = transmittance[1] = transmittance[2] = packet->is_occluded[i] ? 0 : 1;
        rays->has_overflowed |= hits->has_overflowed;
        const struct scene_state *state = rays->scene->state;
        if (packet->is_occluded[i] || !(hits->count || state->medium_count || state->grid_count))
            continue;
        light_media(rays, &jobs[i], sigma);
        rt_path_transmittance(rays->scene, hits, &packet->rays[i], sigma, rays->blend,
                              transmittance);
        if (state->medium_count)
            attenuate_leap(rays, &jobs[i], &packet->rays[i], hits, sigma, transmittance);
    }
    rays->ray_count += count;
}

static void trace(struct rt_shadow_rays *rays, const struct rt_shadow_job *jobs, size_t count)
{
    double passed[RT_LANES][3];
    rt_shadow_rays_trace(rays, jobs, count, passed);
    for (size_t i = 0; i < count; i++)
        rt_shadow_pack(passed[i], rays->filters[jobs[i].filter]);
}

void rt_shadow_rays_add(struct rt_shadow_rays *rays, const struct rt_shadow_job *job)
{
    if (rays->job_count == JOBS_MAX)
        rt_shadow_rays_flush(rays);
    rays->jobs[rays->job_count++] = *job;
    rays->light_counts[job->light]++;
}

/* Sorted by light, in the order of their points: neighbours go together. */
void rt_shadow_rays_flush(struct rt_shadow_rays *rays)
{
    size_t lights = rays->scene->state->light_count;
    uint32_t *counts = rays->light_counts, first = 0;
    for (size_t i = 0; i < lights; i++) {
        uint32_t count = counts[i];
        counts[i] = first;
        first += count;
    }
    for (size_t i = 0; i < rays->job_count; i++)
        rays->sorted[counts[rays->jobs[i].light]++] = rays->jobs[i];
    for (size_t i = 0; i < rays->job_count;) {
        size_t end = i + 1;
        while (end < rays->job_count && end - i < RT_LANES &&
               rays->sorted[end].light == rays->sorted[i].light)
            end++;
        trace(rays, &rays->sorted[i], end - i);
        i = end;
    }
    memset(counts, 0, lights * sizeof *counts);
    rays->job_count = 0;
}

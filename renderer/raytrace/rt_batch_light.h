/* SPDX-License-Identifier: MIT */
/* Light of a batch's surfaces. Internal to rt_batch. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_BATCH_LIGHT_H
#define VITRAIL_RENDERER_RAYTRACE_RT_BATCH_LIGHT_H

#include "renderer/raytrace/rt_batch.h"
#include "renderer/raytrace/rt_reflect.h"

enum { RT_BATCH_JOBS_MAX = 32768 }; /* shadow rays that wait: 1.3 MB */

/* Evaluates materials and fills radiance and filter of every fragment from the first one on. */
void rt_batch_light(struct rt_batch *batch, uint32_t first);

/* A surface being lit. */
struct rt_lit {
    uint32_t index; /* of the fragment */
    const struct rt_fragment *fragment;
    double point[3], view[3]; /* relative to rt_scene.origin; unit, to the viewer */
    double view_z;
    struct rt_surface *surface;
    struct rt_footprint footprint; /* of the pixel, or its part; where the mesh samples textures */
    struct rt_reflector *reflector;
};

/* One surface after the other: the scalar form of what rt_batch_wide does with sixteen. Asks all
 * lights for a fragment. */
void rt_lit_begin(struct rt_batch *batch, uint32_t fragment);

/* Its parts, which rt_batch_wide has in common with it. Materials: fills surface, reflector and
 * shading. False where the surface is not lit. */
MUST_CHECK bool rt_lit_evaluate(struct rt_batch *batch, const struct rt_lit *lit,
                                struct rt_shading *shading);
void rt_lit_add_hemisphere(const struct rt_batch *batch, const struct rt_lit *lit,
                           struct rt_shading *shading);
void rt_lit_ask_area(struct rt_batch *batch, const struct rt_lit *lit, uint32_t light);
void rt_lit_ask_environment(struct rt_batch *batch, const struct rt_lit *lit);
/* What haze lets through of a light; 1 where there is none. */
double rt_lit_pass_haze(const struct rt_batch *batch, const struct rt_lit *lit,
                        const struct rt_ray_job *job);
/* Traces the jobs that wait. */
void rt_lit_flush(struct rt_batch *batch);
/* Where the fragment's next job goes: all of it but its direction, distance and weight. */
static inline struct rt_ray_job *rt_lit_begin_job(struct rt_batch *batch, uint32_t fragment,
                                                  uint32_t light)
{
    if (batch->job_count == RT_BATCH_JOBS_MAX)
        rt_lit_flush(batch);
    struct rt_ray_job *job = &batch->jobs[batch->job_count];
    job->fragment = fragment;
    job->light = light;
    job->is_transparent = !batch->fragments[fragment].is_opaque;
    return job;
}
/* What a light adds to the surface, at once or after its shadow ray. job: begun last. */
void rt_lit_send(struct rt_batch *batch, const struct rt_ray_job *job, bool casts_shadow);

/* Lights that shadow rays wait for: those of the state, and last the environment. */
static inline size_t rt_batch_light_slots(const struct rt_batch *batch)
{
    return batch->desc.scene->state->light_count + 1;
}

#endif

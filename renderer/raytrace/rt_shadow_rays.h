/* SPDX-License-Identifier: MIT */
/* A queue of shadow rays. They wait and are sorted by light, so that a packet of rays of
 * neighbouring points goes to one light. Thread: one per queue. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_SHADOW_RAYS_H
#define VITRAIL_RENDERER_RAYTRACE_RT_SHADOW_RAYS_H

#include "renderer/raytrace/rt_light_set.h"
#include "renderer/raytrace/rt_packet.h"

struct rt_shadow_job { /* one ray, waiting */
    double point[3];   /* relative to rt_scene.origin */
    float normal[3];   /* geometric; its sign does not matter */
    float offset_m;    /* along the normal, to the light's side */
    float direction[3], distance_m;
    uint32_t light;
    uint32_t filter;        /* where the result goes */
    uint32_t excluded_node; /* rt_ray's, like these: */
    uint32_t skip_mesh, skip_triangle;
};

struct rt_shadow_rays { /* zeroed before init */
    const struct rt_scene *scene;
    const struct rt_light_set *light_set;
    enum view_blend_filter blend;
    uint32_t (*filters)[2]; /* out; set by the owner */
    struct rt_shadow_job *jobs, *sorted;
    uint32_t *light_counts; /* of waiting jobs */
    size_t job_count;
    struct rt_packet packet;
    struct rt_hits scratch;
    uint64_t ray_count;
    bool has_overflowed;
};

MUST_CHECK bool rt_shadow_rays_init(struct rt_shadow_rays *rays, const struct rt_scene *scene,
                                    const struct rt_light_set *light_set,
                                    enum view_blend_filter blend, struct error *err);
void rt_shadow_rays_finish(struct rt_shadow_rays *rays); /* accepts zeroed */

void rt_shadow_rays_add(struct rt_shadow_rays *rays, const struct rt_shadow_job *job);
/* Traces all that wait. */
void rt_shadow_rays_flush(struct rt_shadow_rays *rays);

/* Traces at most RT_LANES rays at once; passed: out, the transmittance of each. A ray to infinity
 * needs no light. */
void rt_shadow_rays_trace(struct rt_shadow_rays *rays, const struct rt_shadow_job *jobs,
                          size_t count, double (*passed)[3]);

/* As shaders/shadows/shadow_traced.glsl reads it: relative error 2^-19 of the largest channel. */
void rt_shadow_pack(const double transmittance[3], uint32_t words[2]);

#endif

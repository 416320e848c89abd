/* SPDX-License-Identifier: MIT */
/* Computes in f64 the light that a surface sends to the viewer: every light counts, through every
 * filter on its way. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_LIGHT_H
#define VITRAIL_RENDERER_RAYTRACE_RT_LIGHT_H

#include <math.h>

#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_grids.h"
#include "renderer/raytrace/rt_math.h"
#include "renderer/raytrace/rt_surface.h"

struct rt_lighting {
    const struct rt_scene *scene;
    const struct view *view;
    const struct environment_light *environment; /* may be NULL */
    struct rt_hits shadow_hits;                  /* scratch of one thread; owned */
    struct rt_grid_lines grids;                  /* likewise */
    uint64_t shadow_rays;
    uint32_t seed;       /* of the sequences on area lights; set per camera ray */
    bool is_unshadowed;  /* nothing casts a shadow */
    bool has_overflowed; /* more surfaces on a ray than RT_HITS_MAX */
};

MUST_CHECK bool rt_lighting_init(struct rt_lighting *lighting, const struct rt_scene *scene,
                                 const struct view *view, struct error *err);
void rt_lighting_finish(struct rt_lighting *lighting);

/* Where a ray to a light at this distance counts hits: a light on a caster's plane is not behind it
 * by the rounding of f64. */
static inline void rt_shadow_range(const struct rt_scene *scene, double distance_m,
                                   struct rt_ray *ray)
{
    ray->t_max = isfinite(distance_m) ? distance_m * (1 - 1e-9) : scene->size_m;
    ray->t_min = scene->epsilon * rt_min(ray->t_max, scene->size_m);
}

/* The ray from a point to a light. `on`: as below. */
void rt_shadow_ray(const struct rt_scene *scene, const struct rt_arrival *arrival,
                   const double point[3], const struct rt_hit *on, struct rt_ray *ray);

/* rt_media_at of the light: zeros without media, and for one infinitely far away. */
void rt_light_media(const struct rt_scene *scene, const struct rt_arrival *arrival,
                    const double point[3], struct rt_hits *scratch, double sigma[3]);

/* Transmittance between an arriving light and a point (relative to rt_scene.origin). `on`: the hit
 * that the point lies on, or NULL. Surfaces must be strictly nearer to the light than the point, by
 * the scene's relative epsilon. */
void rt_transmittance(struct rt_lighting *lighting, const struct rt_arrival *arrival,
                      const double point[3], const struct rt_hit *on, double out[3]);

/* Radiance towards `view` (unit, away from the surface), nt, before coverage. */
void rt_radiance(struct rt_lighting *lighting, const struct rt_hit *hit,
                 const struct rt_surface *surface, const double point[3], const double view[3],
                 double out[3]);

/* What the ground plane lets through of what lies behind it. */
void rt_ground_filter(struct rt_lighting *lighting, const struct rt_hit *hit,
                      const struct rt_surface *surface, const double point[3], const double view[3],
                      double filter[3]);
/* The same by the light that arrives, and that which would without shadows. */
void rt_ground_share(const struct rt_scene *scene, const double point[3], const double arriving[3],
                     const double unshadowed[3], double filter[3]);

#endif

/* SPDX-License-Identifier: MIT */
/* Haze on straight ways: what it lets through, and what it scatters of every light into them once
 * (docs/explanation/media.md). Thread: one per rt_lighting. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_HAZE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_HAZE_H

#include "renderer/raytrace/rt_light.h"

/* What haze lets through between a point (relative to rt_scene.origin) and what arrives there; 1 of
 * light from infinitely far away. */
double rt_haze_arrives(const struct rt_scene *scene, const struct view *view,
                       const struct rt_arrival *arrival, const double point[3]);

/* What haze scatters of the light from all around, over its colour where it is opaque [nt].
 * environment: NULL: there is no map. */
void rt_haze_around(const struct rt_scene *scene, const struct environment_light *environment,
                    double around[3]);

/* A stretch of a ray, in units of its direction, with the media around it. */
struct rt_haze_way {
    const struct rt_ray *ray;
    double from, to;     /* to: may be INFINITY */
    double sigma[3];     /* of media, within range */
    const double *range; /* rt_scene_kept_range */
};

/* Adds what the stretch scatters towards the ray's origin to radiance, by the share of light from
 * where it begins, and dims the share. The integral of each light is taken by Gauss and Legendre's
 * rule in panels, whose borders differ between rays, so that edges of shadows dither: over the
 * angle at which a lamp sees the ray (Kulla and Fajardo 2012, "Importance Sampling Techniques for
 * Path Tracing in Participating Media"), and over the transmittance for directional lights. */
void rt_haze_pass(struct rt_lighting *lighting, const struct rt_haze_way *way, double share[3],
                  double radiance[3]);

/* Adds what the density grids on the stretch scatter, alone, and leaves them in lighting->grids.
 * Haze dims it on the way. */
void rt_haze_add_grids(struct rt_lighting *lighting, const struct rt_haze_way *way,
                       const double share[3], double radiance[3]);

/* Adds what the haze on the stretch scatters of one point or spot light, likewise, by the same rule
 * in two panels, or in one where a pixel has many samples. The grids on the stretch are left in
 * lighting->grids. */
void rt_haze_add_lamp(struct rt_lighting *lighting, const struct rt_haze_way *way,
                      const double share[3], size_t light, double radiance[3]);

#endif

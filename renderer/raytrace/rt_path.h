/* SPDX-License-Identifier: MIT */
/* The transmittance of a straight path: the product of the filters that it crosses, and the law of
 * Beer and Lambert inside media, from the sorted points at which it enters and leaves them
 * (docs/explanation/shading.md, section 1). Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_PATH_H
#define VITRAIL_RENDERER_RAYTRACE_RT_PATH_H

#include "renderer/raytrace/rt_surface.h"

/* Signed sum of the extinctions [1/m] of the media that enclose a point (relative to
 * rt_scene.origin): those that a ray from it leaves and has not entered. Zero without media.
 * scratch: overwritten. */
void rt_media_at(const struct rt_scene *scene, const double point[3], struct rt_hits *scratch,
                 double sigma[3]);

/* The same after crossing a hit along the ray; unchanged when its surface bounds no medium. */
void rt_media_cross(const struct rt_scene *scene, const struct rt_hit *hit, double sigma[3]);

/* Multiplies by exp(-sigma * length) for the ray's way between two numbers of its direction's
 * units, where it lies within range (rt_scene_kept_range): what is cut away attenuates nothing. A
 * sum below zero counts as zero. */
void rt_media_pass(const double sigma[3], const struct rt_ray *ray, const double range[2],
                   double from, double to, double through[3]);

/* Multiplies by the filter of a face that is_left_unseen; it reflects nothing
 * (docs/explanation/shading.md, section 2). footprint: as of rt_surface_evaluate. */
void rt_filter_unseen(const struct rt_scene *scene, const struct rt_hit *hit,
                      const struct rt_footprint *footprint, const double direction[3],
                      double through[3]);

/* The excluded node of a ray from a surface: its own if its material has no self shadow, else 0. */
uint32_t rt_path_excluded_node(const struct rt_scene *scene, const struct rt_hit *on);

bool rt_path_is_excluded(const struct rt_scene *scene, const struct rt_ray *ray,
                         const struct rt_hit *hit);

/* Along a ray of unit direction to a light at its t_max. hits: in order, none of them opaque.
 * Neighbouring surfaces of one node that casts once filter once (Lindbeck 2015, 3.2). sigma_end:
 * rt_media_at of the light, zeros for one infinitely far away. */
void rt_path_transmittance(const struct rt_scene *scene, const struct rt_hits *hits,
                           const struct rt_ray *ray, const double sigma_end[3],
                           enum view_blend_filter blend, double out[3]);

#endif

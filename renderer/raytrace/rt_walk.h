/* SPDX-License-Identifier: MIT */
/* What a camera ray sees, through all layers and bent by those that refract or scatter
 * (docs/explanation/shading.md, sections 2 and 8): one ray at a time in f64, every light. The
 * reference is made of such rays; production has them behind the first surface that bends. Thread:
 * one per walker. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_WALK_H
#define VITRAIL_RENDERER_RAYTRACE_RT_WALK_H

#include "renderer/raytrace/rt_light.h"
#include "renderer/raytrace/rt_pixel.h"

enum { RT_BENDS_MAX = 16 }; /* of one ray; then it goes straight on through what it meets */

struct rt_walker_desc {
    const struct rt_scene *scene;                /* required; borrowed, as the next two */
    const struct view *view;                     /* required */
    const struct environment_light *environment; /* NULL: none */
    uint32_t branches; /* directions behind the first rough surface of a ray; >= 1 */
    /* Optional: of rays to those of the next pixel to the right and down, at distance 1, or of
     * orthographic cameras anywhere; NULL: textures are read at their finest level. */
    const double (*way)[3];
    bool is_orthographic;
    double begin; /* of camera rays: where their way begins, behind the origin of orthographic ones
                   */
};

struct rt_walker {
    struct rt_walker_desc desc;
    struct rt_lighting lighting; /* its seed is set per camera ray */
    struct rt_hits hits;         /* scratch */
    bool has_overflowed;
};

MUST_CHECK bool rt_walker_init(struct rt_walker *walker, const struct rt_walker_desc *desc,
                               struct error *err);
void rt_walker_finish(struct rt_walker *walker); /* accepts zeroed */

/* All that the ray sees. sigma: rt_media_at its origin. */
void rt_walk(struct rt_walker *walker, const struct rt_ray *ray, const double sigma[3],
             struct rt_seen *seen);

/* A ray at a surface that bends it. */
struct rt_walk_turn {
    const struct rt_hit *hit;
    const double *origin, *direction; /* of the ray; relative to rt_scene.origin */
    double sigma[3];                  /* before the surface */
    double distance;                  /* from the eye to the ray's origin, for the footprint */
    bool is_lit; /* light and filter of the surface are the caller's: only what is behind it is
                    seen. Only for one that the ray enters */
};
void rt_walk_on(struct rt_walker *walker, const struct rt_walk_turn *turn, struct rt_seen *seen);

/* Whether a hit of a camera ray ends the straight part of its way. */
bool rt_walk_bends(const struct rt_scene *scene, const struct rt_hit *hit);

/* The default or the view's own number. samples: of a pixel. */
uint32_t rt_walk_branches(const struct view *view, int samples);

#endif

/* SPDX-License-Identifier: MIT */
/* The directions in which a camera ray goes on behind a transmissive surface: Snell's law, and its
 * spread over the visible normals of a rough surface (docs/explanation/shading.md, section 8).
 * Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_BEND_H
#define VITRAIL_RENDERER_RAYTRACE_RT_BEND_H

#include "renderer/raytrace/rt_surface.h"

enum { RT_BEND_CHANNELS = 3 };

struct rt_bend { /* one surface, met by one ray */
    enum state_bend kind;
    bool enters;                  /* the ray meets its front */
    double way[3];                /* unit, of the ray */
    double normal[3], facet[3];   /* unit, against the ray: for shading, of the triangle */
    double ior[RT_BEND_CHANNELS]; /* of the inside */
    bool disperses;               /* the channels differ */
    double alpha;                 /* of the visible normals; 0: it is smooth */
    double thickness_m;           /* of a slab that is entered */
};

/* way: of the ray, of any length. */
void rt_bend_init(struct rt_bend *bend, const struct rt_scene *scene, const struct rt_hit *hit,
                  const struct rt_surface *surface, const double way[3]);

/* The direction (unit) of a channel. u: two numbers in [0, 1), which choose the normal where it is
 * rough. shift: the ray goes on from the hit's point plus this [m]. False: it is totally
 * reflected, back to where it comes from. */
bool rt_bend_ray(const struct rt_bend *bend, int channel, const double u[2], double direction[3],
                 double shift[3]);

#endif

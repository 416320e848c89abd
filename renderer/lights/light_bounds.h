/* SPDX-License-Identifier: MIT */
/* What a light can reach, in view space: spheres and spherical sectors, grown so that no rounding
 * loses a light. View space here: x right, y up, z forward (the positive view depth). CPU only.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_LIGHTS_LIGHT_BOUNDS_H
#define VITRAIL_RENDERER_LIGHTS_LIGHT_BOUNDS_H

#include "renderer/scene/camera.h"

struct light_bound {
    uint32_t light; /* index into the lights it was made from */
    bool is_cone;
    double center[3], radius_m;  /* bounding sphere, grown by slack_m */
    double apex[3], axis[3];     /* cones: where the light is, and unit direction of travel */
    double range_m;              /* as given */
    double cos_outer, sin_outer; /* cones: of the half angle, grown by a f32 cosine's rounding */
    double slack_m;    /* f32 rounding of eye-relative positions, and of shader arithmetic */
    double z_lo, z_hi; /* depths it spans; z_lo >= 0 for perspective cameras */
};

/* Zeroed = empty. Arrays are kept between uses. */
struct light_bounds {
    /* Bounded lights that a camera of this kind can see, ascending light index. */
    struct light_bound *items;
    size_t count, capacity;
    uint32_t *global; /* directional and unbounded lights, ascending */
    size_t global_count;
};

/* Sorts lights into bounded and global ones. Perspective cameras drop what is wholly behind the
 * eye. */
MUST_CHECK bool light_bounds_collect(struct light_bounds *bounds, const struct state_light *lights,
                                     size_t light_count, const struct camera *camera,
                                     struct error *err);
void light_bounds_finish(struct light_bounds *bounds);

/* Support of the bound: the largest dot(p, unit) over its points p. */
double light_bound_support(const struct light_bound *bound, const double unit[3]);

/* The line (origin + z * slope, z), and how far points of its block may lie from it at a depth. */
struct view_ray {
    double origin[2], slope[2];
    double spread_m, spread_per_m; /* distance allowed at depth z: spread_m + z * spread_per_m */
};

/* Depths at which the widened line may meet the bound, or false when it never does. Conservative: a
 * point of the bound within the spread of the line has its depth inside [front, back]. */
bool light_bound_interval(const struct light_bound *bound, const struct view_ray *ray,
                          double *front, double *back);

#endif

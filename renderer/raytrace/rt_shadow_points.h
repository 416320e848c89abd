/* SPDX-License-Identifier: MIT */
/* The points of a window that rays start from, for the files of raytrace_shadows.h only. Thread:
 * any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_SHADOW_POINTS_H
#define VITRAIL_RENDERER_RAYTRACE_RT_SHADOW_POINTS_H

#include "renderer/raytrace/raytrace_shadows.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_shadow_rays.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum { RT_POINTS_TILE_PX = 16 };

struct raytrace_shadows {
    struct raytrace_desc desc;
    struct rt_scene own, *scene;
    struct rt_light_set light_set;
    /* Of each light at a point: one, or those of an area light's points; 0: it is not shadowed. */
    uint32_t *filters;
    uint32_t filters_max;
    double farthest_m; /* from the eye: no surface is farther */
};

struct rt_point { /* a point, and what all its rays share */
    struct rt_shadow_job job;
    float normal[3]; /* for shading */
    double view[3];  /* unit, towards the viewer */
    double roughness;
    double footprint_m;
    uint32_t seed; /* of sequences */
    bool transmits;
};
void rt_point_begin(struct rt_point *p, const struct raytrace_shadows *shadows,
                    struct rt_hits *scratch, const struct raytrace_shadow_points *points,
                    size_t index);

/* Its pixel in the window. */
static inline uint32_t rt_point_pixel(const struct shadow_point *point)
{
    return point->pixel_roughness & ((1u << SHADOW_POINT_PIXEL_BITS) - 1);
}

/* Calls `visit` for each point of the tile that light is asked for, until the job is cancelled. */
void rt_points_visit_tile(const struct raytrace_shadow_points *points, int tile, struct rt_job *job,
                          void (*visit)(void *context, size_t index), void *context);

/* A thread that sends rays from points: the first member of a form's worker. */
struct rt_point_worker {
    struct rt_job *job;
    struct rt_shadow_rays rays;
};
MUST_CHECK bool rt_point_worker_init(struct rt_point_worker *worker,
                                     const struct raytrace_shadows *shadows, struct rt_job *job,
                                     struct error *err);
/* Adds what its rays counted to the job, once it has run out of units. */
void rt_point_worker_end(const struct rt_point_worker *worker);
void rt_point_worker_finish(void *worker); /* as struct rt_form has it */

struct rt_points_run {
    const struct raytrace_shadows *shadows;      /* required, as all of these */
    const struct raytrace_shadow_points *points; /* whose tiles are the units */
    const void *shared;                          /* of struct rt_job */
    const char *subject;                         /* of the run, for its errors */
};
/* Runs the form over all tiles. Adds the time to *took_ms and the rays to stats. */
MUST_CHECK bool rt_points_run(const struct rt_points_run *run, const struct rt_form *form,
                              double *took_ms, struct raytrace_stats *stats, struct error *err);

#endif

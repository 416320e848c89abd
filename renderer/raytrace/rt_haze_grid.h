/* SPDX-License-Identifier: MIT */
/* Haze in production pictures: the light that it scatters towards the eye, found in a grid of
 * columns and slices (renderer/scene/atmosphere_grid.h) by a ray from one point of a slice to each
 * light that reaches it, and looked up by the rays of pixels. It has the formulas of the
 * rasteriser's (shaders/shading/atmosphere_light.comp.glsl). Thread: built by one, then read by
 * any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_HAZE_GRID_H
#define VITRAIL_RENDERER_RAYTRACE_RT_HAZE_GRID_H

#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_light_set.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/scene/haze_glow.h"

enum { RT_HAZE_GLOW_SIDE = 9 }; /* columns */

struct rt_haze_glow { /* a lamp in the picture (renderer/raytrace/rt_haze_glow.h) */
    uint32_t light;
    double place[2];      /* in columns of the image, y up */
    int first_x, first_y; /* of the image: the first of the columns around it */
    float *lights, *sums; /* of the grid, of this lamp alone, in these columns */
};

struct rt_haze_grid { /* zeroed before init */
    const struct rt_job *job;
    struct atmosphere_grid size;
    struct atmosphere_slices slices;
    double offset;   /* of all points in their quarters of slices, (0, 1) */
    double *borders; /* of the slices, in depths of the view [m], with the end of the last one */
    float *reaches;  /* of columns: the farthest depth that is seen there */
    /* Slice by slice, row by row from below, 3 channels over the haze's colour, [nt]: */
    float *lights; /* what a slice of a column scatters; NULL once it is summed */
    float *sums;   /* at corners, from the eye to the end of a slice; NULL: no light shines */
    struct rt_haze_glow glows[HAZE_GLOWS_MOST];
    int glow_count;
    float around[3]; /* what haze of any thickness scatters of the light from all around [nt] */
};

/* Finds the light of the job's tile. A cancelled job is that on return, and the grid is dark. */
MUST_CHECK bool rt_haze_grid_init(struct rt_haze_grid *grid, struct rt_job *job,
                                  const struct rt_light_set *light_set, struct error *err);
/* The parts of it: makes room, for a window of the job's picture; and lights the slices, with all
 * lamps in all columns. */
MUST_CHECK bool rt_haze_grid_place(struct rt_haze_grid *grid, const struct rt_job *job,
                                   const struct atmosphere_grid *size, struct error *err);
MUST_CHECK bool rt_haze_grid_light(struct rt_haze_grid *grid, struct rt_job *job,
                                   const struct rt_light_set *light_set, struct error *err);
void rt_haze_grid_finish(struct rt_haze_grid *grid); /* accepts zeroed */

/* Sums along columns, looked up between their corners. */
struct rt_haze_sums {
    const float *sums;
    int corners[2], first[2]; /* the first corner is one column behind the first column */
};
/* Each corner has the mean of the four columns around it. */
void rt_haze_sum_up(const float *lights, const int columns[2], int slices, float *sums);

/* The way of one ray through the haze, from the eye on. */
struct rt_haze_sight {
    const struct rt_haze_grid *grid;
    const struct rt_ray *ray;
    double place[2];         /* of the picture, in pixels, y up */
    double origin_m, unit_m; /* height at depth 0; metres per unit of depth */
    double z;                /* depth that it has come to */
    double open;             /* of the haze up to there */
    double scattered[3];     /* up to there, towards the eye */
    double light[3]; /* out: added to, until its owner takes it away: radiance where the share was 1
                      */
};

/* x, y: pixel coordinates of the picture, y down. */
void rt_haze_sight_begin(struct rt_haze_sight *sight, const struct rt_haze_grid *grid,
                         const struct rt_ray *ray, const double place[2]);
/* From the eye to a depth: between four corners, and between the ends of a slice. */
void rt_haze_sums_find(const struct rt_haze_sums *sums, const struct rt_haze_sight *sight, double z,
                       double out[3]);
/* Goes on to t of the ray, which may be INFINITY, in media of extinction sigma [1/m] or NULL.
 * share: of light from where it was; what the stretch scatters times it is added, and it is dimmed.
 */
void rt_haze_sight_pass(struct rt_haze_sight *sight, double t, const double *sigma,
                        double share[3]);

#endif

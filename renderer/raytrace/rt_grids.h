/* SPDX-License-Identifier: MIT */
/* Density grids on straight ways: the integral of the density is exact but for rounding. Thread:
 * any; struct rt_grid_lines: one. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_GRIDS_H
#define VITRAIL_RENDERER_RAYTRACE_RT_GRIDS_H

#include "renderer/raytrace/rt_scene.h"

/* Multiplies by what the grids let through of the ray's way between two numbers of its direction's
 * units; `to` may be INFINITY. Grids are cut off by range (rt_scene_kept_range). */
void rt_grids_pass(const struct rt_scene *scene, const struct rt_ray *ray, const double range[2],
                   double from, double to, double through[3]);

/* One grid on a stretch of a ray: how deep it is up to each border of its pieces. */
struct rt_grid_line {
    const struct state_grid *grid;
    struct density_walk walk;
    size_t count;       /* borders, at least 2 */
    const double *at;   /* along the ray, in units of its direction */
    const double *deep; /* the integral of the value up to there [m] */
};

/* All grids on a stretch. */
struct rt_grid_lines {
    struct rt_grid_line *lines;
    size_t count;
    double unit_m;   /* length of the ray's direction */
    double *borders; /* owned, at and deep of all lines */
    size_t capacity; /* of `at` of one line */
};
MUST_CHECK bool rt_grid_lines_init(struct rt_grid_lines *lines, const struct scene_state *state,
                                   struct error *err);
void rt_grid_lines_finish(struct rt_grid_lines *lines); /* accepts zeroed */

/* As rt_grids_pass. Grids that are not met are no lines. */
void rt_grid_lines_find(struct rt_grid_lines *lines, const struct rt_scene *scene,
                        const struct rt_ray *ray, const double range[2], double from, double to);

/* The integral of the value of a grid from the beginning of the stretch on [m]. */
double rt_grid_line_deep(const struct rt_grid_lines *lines, const struct rt_grid_line *line,
                         double at);
/* The value of the grid. */
double rt_grid_line_value(const struct rt_grid_line *line, double at);

/* Multiplies by what all lines let through up to there. */
void rt_grid_lines_pass(const struct rt_grid_lines *lines, double at, double through[3]);

#endif

/* SPDX-License-Identifier: MIT */
/* Values of a density grid in f64: at a point, and summed up along a line. Coordinates are those
 * of voxels: [0, size] along each axis, centres at halves. Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_DENSITY_GRID_H
#define VITRAIL_RENDERER_SCENE_DENSITY_GRID_H

#include "renderer/scene/scene.h"

struct density_grid { /* borrowed from a scene */
    const struct scene_grid_brick *bricks;
    const float (*values)[SCENE_BRICK_VALUES];
    uint32_t size[3], bricks_along[3];
};

uint64_t scene_grid_brick_count(const struct scene_grid *grid);

struct density_grid density_grid_of(const struct scene *scene, const struct scene_grid *grid);

/* A value that is stored; of the nearest voxel for one outside. */
float density_grid_voxel(const struct density_grid *grid, int64_t x, int64_t y, int64_t z);

/* Trilinear between centres; 0 outside the box. */
double density_grid_at(const struct density_grid *grid, const double point[3]);

/* A straight way through the box, cut at the planes through centres: between two neighbouring cuts
 * the value is a polynomial of degree 3 in the distance. */
struct density_walk {
    const struct density_grid *grid;
    double from[3], step[3];
    double t, end;    /* how far it is, and where it leaves the box, in steps */
    int64_t brick[3]; /* of the last piece, if there was one, and the bound in it */
    double bound;
    bool has_brick;
};

/* False: the way between t_min and t_max steps does not meet the box. t_max may be INFINITY. */
bool density_walk_begin(struct density_walk *walk, const struct density_grid *grid,
                        const double from[3], const double steps[3], double t_min, double t_max);

/* The next piece [from, to] with what its value may not exceed: 0 where all around it is empty, and
 * such a piece may be long. False: it has left the box. */
struct density_piece {
    double from, to; /* steps */
    double bound;
};
bool density_walk_next(struct density_walk *walk, struct density_piece *piece);

/* The integral of the value over the steps [from, to] inside one piece. Exact but for rounding. */
double density_walk_integrate(const struct density_walk *walk, double from, double to);

#endif

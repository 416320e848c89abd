/* SPDX-License-Identifier: MIT */
/* The grid of `area` in f64 and without its margins, as Wang et al. 2014, section 3.1, have it:
 * which triangles join which cells under a rectangle or a disk, by which rectangle, and which
 * points a convex hull would hold instead. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_AREA_MODEL_H
#define VITRAIL_TESTS_SUPPORT_AREA_MODEL_H

#include "tests/support/area_stage.h"

struct area_model {                 /* of the points of a stage */
    const struct area_light *light; /* borrowed: an area */
    uint32_t side;                  /* of the grid [cells] */
    uint32_t point_count;
    double (*places)[3]; /* owned; u, v and depth of each point */
    double low[2], high[2], farthest;
    double *depths;        /* owned; the farthest point of each cell; below 0: there is none */
    uint32_t *cell_points; /* owned; their number */
};

/* How far what a triangle hides is followed: to the farthest point of all; to that of the cells
 * that are met so, which is the correction; and for each of these cells once more, to its own. */
enum area_extrusion {
    AREA_EXTRUDE_ALL,
    AREA_EXTRUDE_CELLS,
    AREA_EXTRUDE_CELL,
};

struct area_margins { /* by which everything is widened; zero: the definition */
    double place, depth_m;
};

void area_model_init(struct area_model *model, const struct area_stage *stage,
                     const struct area_light *light, uint32_t side);
void area_model_finish(struct area_model *model);

uint32_t area_model_cell(const struct area_model *model, const double place[2]);

/* The rectangle of what a triangle hides up to a depth. All of the triangle lies before the light.
 */
struct area_rectangle {
    double low[2], high[2];
};
struct area_rectangle area_model_rectangle(const struct area_model *model,
                                           const struct area_triangle *triangle, double depth_m);
/* The depth to which the correction extrudes; below 0: the triangle hides nothing. */
double area_model_depth(const struct area_model *model, const struct area_triangle *triangle,
                        struct area_margins margins);

/* Calls `visit` with each cell that the triangle joins. */
void area_model_assign(const struct area_model *model, const struct area_triangle *triangle,
                       enum area_extrusion extrusion, struct area_margins margins,
                       void (*visit)(void *context, uint32_t cell), void *context);

/* Of all points: those in the rectangle of a triangle, extruded with the correction, and those in
 * the convex hull of the fifteen points that the rectangle is around. */
void area_model_count_hull(const struct area_model *model, const struct area_triangle *triangle,
                           uint64_t *in_rectangle, uint64_t *in_hull);

#endif

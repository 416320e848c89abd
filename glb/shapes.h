/* SPDX-License-Identifier: MIT */
/* Simple solids and sheets as triangles, to be put into a GLB. Thread: one per shape.
 *
 * A shape collects any number of pieces. Front faces are counter-clockwise and look outward. Pieces
 * are given in local coordinates, metres, and go through the place set at that moment. Texture
 * coordinates are metres along the surface unless a comment says otherwise; v grows downward, as in
 * glTF. A shape that ran out of memory stays empty from then on; shape_give_mesh reports it. */
#ifndef VITRAIL_GLB_SHAPES_H
#define VITRAIL_GLB_SHAPES_H

#include <stddef.h>
#include <stdint.h>

#include "glb/glb_builder.h"

/* Zeroed = empty, at the origin. The fields are read-only for callers. */
struct shape {
    float *positions, *normals, *texcoords; /* owned; 3, 3, 2 per vertex */
    uint32_t *indices;                      /* owned; triangles */
    size_t vertex_count, vertex_capacity;
    size_t index_count, index_capacity;
    double origin[3], x[3], y[3], z[3]; /* the place; all axes zero = those of the mesh */
    bool is_out_of_memory;
};

void shape_finish(struct shape *shape);

/* Where pieces go from now on: local +X along x_axis, +Y along y_axis (unit, perpendicular, NULL =
 * +X and +Y of the mesh), +Z along their cross product. origin NULL = zero. */
void shape_set_place(struct shape *shape, const double origin[3], const double x_axis[3],
                     const double y_axis[3]);

/* Adds the shape as a mesh of one primitive and finishes it. 0 on failure. */
int shape_give_mesh(struct shape *shape, struct glb_builder *builder, const char *name,
                    int material);

/* -- Sheets (one side; give them a double-sided material) -- */

/* Parallelogram; texture coordinates run over [0,1], the image upright when edge_v points up. */
void shape_add_quad(struct shape *shape, const double corner[3], const double edge_u[3],
                    const double edge_v[3]);
/* The same, cut into columns x rows cells. */
void shape_add_grid(struct shape *shape, const double corner[3], const double edge_u[3],
                    const double edge_v[3], int columns, int rows);

struct shape_curtain_desc {
    double width, height; /* m; hangs from y = 0 down, x in [0, width] */
    double fold_depth;    /* m, half of the way from crest to trough, at the hem */
    double folds;         /* crests over the width */
    double gather;        /* [0,1): how much the hem is drawn towards x = 0 */
    double phase_rad;     /* of the first fold */
    int columns, rows;
};
/* A folded cloth; shallow folds at the rail, deep ones at the hem. Texture coordinates in [0,1]. */
void shape_add_curtain(struct shape *shape, const struct shape_curtain_desc *desc);

/* -- Solids -- */

void shape_add_box(struct shape *shape, const double low[3], const double high[3]);
void shape_add_sphere(struct shape *shape, const double center[3], double radius, int slices,
                      int stacks);
/* A frustum with its caps standing on center; radius_top 0 makes a cone, equal radii a cylinder. */
void shape_add_cone(struct shape *shape, const double center[3], double radius_bottom,
                    double radius_top, double height, int slices);
void shape_add_cylinder(struct shape *shape, const double center[3], double radius, double height,
                        int slices);

struct shape_lathe_desc {
    const double (*profile)[2]; /* (radius, y), bottom to top along the outside */
    int count;
    bool is_closed;  /* the last point joins the first: a ring */
    bool is_faceted; /* otherwise corners below 35 degrees are smooth */
    int slices;
};
/* Turns the profile about +Y through the local origin. */
void shape_add_lathe(struct shape *shape, const struct shape_lathe_desc *desc);
/* A ring about +Y with a round section. */
void shape_add_torus(struct shape *shape, const double center[3], double radius, double thickness,
                     int slices, int sides);

/* -- Outlines: polygons in the local xy plane, counter-clockwise, not self-intersecting -- */

enum { SHAPE_OUTLINE_MAX = 256 };

struct shape_outline {
    double points[SHAPE_OUTLINE_MAX][2];
    int count;
};

void shape_outline_circle(struct shape_outline *outline, double center_x, double center_y,
                          double radius, int segments);
/* An arched opening: [-width/2, width/2] wide, sides from y_bottom up to y_spring, then two arcs
 * whose radius is pointedness * width: 0.5 is a round arch, 1 an equilateral pointed one. */
void shape_outline_arch(struct shape_outline *outline, double width, double y_bottom,
                        double y_spring, double pointedness, int segments);

/* A flat face towards +Z; texture coordinates cover the bounds of the outline with [0,1]. */
void shape_add_face(struct shape *shape, const struct shape_outline *outline);
/* The outline drawn out from z = 0 to z = depth, with both ends. */
void shape_add_extrusion(struct shape *shape, const struct shape_outline *outline, double depth);
/* The rectangle low..high from z = 0 to z = depth with a hole. Every point of the hole must be
 * visible from the middle of the hole's bounds. */
void shape_add_pierced_slab(struct shape *shape, const double low[2], const double high[2],
                            const struct shape_outline *hole, double depth);
/* A half ring in the xy plane above y = 0, from z = 0 to z = depth: an arch, or a barrel vault. */
void shape_add_arch(struct shape *shape, double radius_inner, double radius_outer, double depth,
                    int segments);

#endif

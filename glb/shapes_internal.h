/* SPDX-License-Identifier: MIT */
/* What the files of the shapes share; nothing outside glb includes it. */
#ifndef VITRAIL_GLB_SHAPES_INTERNAL_H
#define VITRAIL_GLB_SHAPES_INTERNAL_H

#include "glb/shapes.h"

/* Adds a vertex through the place of the shape; returns its index. The normal is made unit. */
uint32_t shape_add_vertex(struct shape *shape, const double position[3], const double normal[3],
                          double u, double v);
void shape_add_triangle(struct shape *shape, uint32_t a, uint32_t b, uint32_t c);
/* Two triangles over four corners in counter-clockwise order. */
void shape_add_cell(struct shape *shape, uint32_t a, uint32_t b, uint32_t c, uint32_t d);

#endif

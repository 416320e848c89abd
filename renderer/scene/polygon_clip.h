/* SPDX-License-Identifier: MIT */
/* Convex polygons cut by planes: of a plane {a, b, c, d}, what has a x + b y + c z + d >= 0 is
 * kept. f64. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_POLYGON_CLIP_H
#define VITRAIL_RENDERER_SCENE_POLYGON_CLIP_H

#include "renderer/view.h"

enum {
    POLYGON_PLANES_MAX = VIEW_CLIP_PLANES_MAX + 1, /* the clip planes, and the near plane */
    POLYGON_CORNERS_MAX = 3 + POLYGON_PLANES_MAX   /* of a triangle that all of them cut */
};

/* Compares by x, then y, then z, for qsort. */
int points_compare(const double a[3], const double b[3]);

/* The height of a point over the plane, in lengths of its normal. */
double plane_height(const double plane[4], const double point[3]);

/* Finds where a segment with an end on either side meets the plane, with the same bits from either
 * end. */
void plane_meet(const double plane[4], const double a[3], const double b[3], double out[3]);

/* Sutherland and Hodgman 1974, "Reentrant Polygon Clipping", one plane. Returns how many corners
 * are left, one more than count at the most: a convex polygon crosses a plane twice, and where
 * heights are nothing but rounding, so that signs change more often, crossings above the second are
 * left out. corners has room for count + 1, which is at most POLYGON_CORNERS_MAX. */
int polygon_clip(const double plane[4], double (*corners)[3], int count);

#endif

/* SPDX-License-Identifier: MIT */
/* Pieces cut along an outline: faces, extrusions, walls with an opening, arches and vaults. */
#include "glb/shapes_internal.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;
static const double smooth_cosine = 0.9; /* corners below 26 degrees are smooth */

static void outline_push(struct shape_outline *outline, double x, double y)
{
    if (outline->count == SHAPE_OUTLINE_MAX)
        return;
    outline->points[outline->count][0] = x;
    outline->points[outline->count][1] = y;
    outline->count++;
}

void shape_outline_circle(struct shape_outline *outline, double center_x, double center_y,
                          double radius, int segments)
{
    outline->count = 0;
    for (int i = 0; i < segments; i++) {
        double angle = 2 * pi * i / segments;
        outline_push(outline, center_x + radius * cos(angle), center_y + radius * sin(angle));
    }
}

void shape_outline_arch(struct shape_outline *outline, double width, double y_bottom,
                        double y_spring, double pointedness, int segments)
{
    double radius = pointedness * width, offset = radius - width / 2;
    double top = acos(offset / radius); /* angle at which the arcs meet above the middle */
    int half = segments / 2;
    outline->count = 0;
    outline_push(outline, -width / 2, y_bottom);
    outline_push(outline, width / 2, y_bottom);
    for (int i = 0; i < half; i++) {
        double angle = top * i / half;
        outline_push(outline, -offset + radius * cos(angle), y_spring + radius * sin(angle));
    }
    outline_push(outline, 0, y_spring + radius * sin(top));
    for (int i = half - 1; i >= 0; i--) {
        double angle = top * i / half;
        outline_push(outline, offset - radius * cos(angle), y_spring + radius * sin(angle));
    }
}

static double turn(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static bool is_ear(const struct shape_outline *outline, const int *ring, int count, int i)
{
    int before = (i + count - 1) % count, after = (i + 1) % count;
    const double *a = outline->points[ring[before]], *b = outline->points[ring[i]];
    const double *c = outline->points[ring[after]];
    if (turn(a, b, c) <= 0)
        return false;
    for (int k = 0; k < count; k++) {
        const double *p = outline->points[ring[k]];
        if (k != before && k != i && k != after && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 &&
            turn(c, a, p) >= 0)
            return false;
    }
    return true;
}

/* Ear clipping (Meisters 1975, "Polygons have ears"); O(n^3), n is small. first: index of the
 * vertex of point 0, the others follow. */
static void clip_ears(struct shape *shape, const struct shape_outline *outline, uint32_t first,
                      bool is_reversed)
{
    int ring[SHAPE_OUTLINE_MAX], count = outline->count;
    for (int i = 0; i < count; i++)
        ring[i] = i;
    while (count >= 3) {
        int ear = 0;
        while (ear < count && !is_ear(outline, ring, count, ear))
            ear++;
        if (ear == count)
            ear = 0; /* only slivers are left: cut anywhere */
        uint32_t a = first + (uint32_t)ring[(ear + count - 1) % count];
        uint32_t b = first + (uint32_t)ring[ear], c = first + (uint32_t)ring[(ear + 1) % count];
        shape_add_triangle(shape, is_reversed ? c : a, b, is_reversed ? a : c);
        memmove(ring + ear, ring + ear + 1, (size_t)(count - ear - 1) * sizeof *ring);
        count--;
    }
}

void shape_add_face(struct shape *shape, const struct shape_outline *outline)
{
    static const double normal[3] = {0, 0, 1};
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < outline->count; i++)
        for (int axis = 0; axis < 2; axis++) {
            low[axis] = fmin(low[axis], outline->points[i][axis]);
            high[axis] = fmax(high[axis], outline->points[i][axis]);
        }
    uint32_t first = (uint32_t)shape->vertex_count;
    for (int i = 0; i < outline->count; i++) {
        double p[3] = {outline->points[i][0], outline->points[i][1], 0};
        shape_add_vertex(shape, p, normal, (p[0] - low[0]) / (high[0] - low[0]),
                         (high[1] - p[1]) / (high[1] - low[1]));
    }
    clip_ears(shape, outline, first, false);
}

static void add_end(struct shape *shape, const struct shape_outline *outline, double z,
                    bool is_front)
{
    double normal[3] = {0, 0, is_front ? 1 : -1};
    uint32_t first = (uint32_t)shape->vertex_count;
    for (int i = 0; i < outline->count; i++) {
        double p[3] = {outline->points[i][0], outline->points[i][1], z};
        shape_add_vertex(shape, p, normal, p[0], -p[1]);
    }
    clip_ears(shape, outline, first, !is_front);
}

/* Outward normal of the edge from point i to the next. */
static void edge_normal(const struct shape_outline *outline, int i, double n[2])
{
    const double *a = outline->points[i], *b = outline->points[(i + 1) % outline->count];
    double length = hypot(b[0] - a[0], b[1] - a[1]);
    n[0] = (b[1] - a[1]) / length;
    n[1] = (a[0] - b[0]) / length;
}

/* Normal of edge i at the end it shares with edge other: the mean where the corner is smooth. */
static void corner_normal(const struct shape_outline *outline, int i, int other, double n[3])
{
    double m[2];
    edge_normal(outline, i, n);
    edge_normal(outline, (other + outline->count) % outline->count, m);
    if (n[0] * m[0] + n[1] * m[1] >= smooth_cosine) {
        n[0] += m[0];
        n[1] += m[1];
    }
    n[2] = 0;
}

/* The wall along an outline, facing out of it, or into it for a hole. */
static void add_rim(struct shape *shape, const struct shape_outline *outline, double depth,
                    bool is_hole)
{
    double along = 0;
    for (int i = 0; i < outline->count; i++) {
        const double *a = outline->points[i], *b = outline->points[(i + 1) % outline->count];
        double na[3], nb[3], length = hypot(b[0] - a[0], b[1] - a[1]);
        corner_normal(outline, i, i - 1, na);
        corner_normal(outline, i, i + 1, nb);
        for (int k = 0; is_hole && k < 2; k++) {
            na[k] = -na[k];
            nb[k] = -nb[k];
        }
        double low_a[3] = {a[0], a[1], 0}, high_a[3] = {a[0], a[1], depth};
        double low_b[3] = {b[0], b[1], 0}, high_b[3] = {b[0], b[1], depth};
        uint32_t c0 = shape_add_vertex(shape, low_a, na, 0, along);
        uint32_t c1 = shape_add_vertex(shape, low_b, nb, 0, along + length);
        uint32_t c2 = shape_add_vertex(shape, high_b, nb, depth, along + length);
        uint32_t c3 = shape_add_vertex(shape, high_a, na, depth, along);
        if (is_hole)
            shape_add_cell(shape, c3, c2, c1, c0);
        else
            shape_add_cell(shape, c0, c1, c2, c3);
        along += length;
    }
}

void shape_add_extrusion(struct shape *shape, const struct shape_outline *outline, double depth)
{
    add_end(shape, outline, 0, false);
    add_end(shape, outline, depth, true);
    add_rim(shape, outline, depth, false);
}

/* Where the ray from c towards p leaves the rectangle. */
static void to_rectangle(const double c[2], const double p[2], const double low[2],
                         const double high[2], double out[2])
{
    double scale = INFINITY;
    for (int axis = 0; axis < 2; axis++) {
        double d = p[axis] - c[axis];
        if (d > 0)
            scale = fmin(scale, (high[axis] - c[axis]) / d);
        if (d < 0)
            scale = fmin(scale, (low[axis] - c[axis]) / d);
    }
    for (int axis = 0; axis < 2; axis++)
        out[axis] = fmin(high[axis], fmax(low[axis], c[axis] + scale * (p[axis] - c[axis])));
}

/* The triangles between edge a-b of the hole and the rectangle: through the corner of the
 * rectangle that lies between the two rays, when there is one. */
static void add_sector(struct shape *shape, const double c[2], const double a[2], const double b[2],
                       const double low[2], const double high[2], double z, bool is_front)
{
    double corners[4][2] = {
        {low[0], low[1]}, {high[0], low[1]}, {high[0], high[1]}, {low[0], high[1]}};
    double normal[3] = {0, 0, is_front ? 1 : -1}, fan[5][2];
    int count = 0;
    memcpy(fan[count++], b, sizeof fan[0]);
    memcpy(fan[count++], a, sizeof fan[0]);
    to_rectangle(c, a, low, high, fan[count++]);
    for (int i = 0; i < 4; i++)
        if (turn(c, a, corners[i]) > 0 && turn(c, b, corners[i]) < 0 && count < 4)
            memcpy(fan[count++], corners[i], sizeof fan[0]);
    to_rectangle(c, b, low, high, fan[count++]);
    uint32_t ids[5];
    for (int i = 0; i < count; i++) {
        double p[3] = {fan[i][0], fan[i][1], z};
        ids[i] = shape_add_vertex(shape, p, normal, p[0], -p[1]);
    }
    for (int i = 2; i < count; i++)
        shape_add_triangle(shape, ids[0], ids[is_front ? i - 1 : i], ids[is_front ? i : i - 1]);
}

void shape_add_pierced_slab(struct shape *shape, const double low[2], const double high[2],
                            const struct shape_outline *hole, double depth)
{
    struct shape_outline rectangle = {
        .points = {{low[0], low[1]}, {high[0], low[1]}, {high[0], high[1]}, {low[0], high[1]}},
        .count = 4};
    double hole_low[2] = {INFINITY, INFINITY}, hole_high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < hole->count; i++)
        for (int axis = 0; axis < 2; axis++) {
            hole_low[axis] = fmin(hole_low[axis], hole->points[i][axis]);
            hole_high[axis] = fmax(hole_high[axis], hole->points[i][axis]);
        }
    double center[2] = {(hole_low[0] + hole_high[0]) / 2, (hole_low[1] + hole_high[1]) / 2};
    for (int i = 0; i < hole->count; i++) {
        const double *a = hole->points[i], *b = hole->points[(i + 1) % hole->count];
        add_sector(shape, center, a, b, low, high, 0, false);
        add_sector(shape, center, a, b, low, high, depth, true);
    }
    add_rim(shape, &rectangle, depth, false);
    add_rim(shape, hole, depth, true);
}

void shape_add_arch(struct shape *shape, double radius_inner, double radius_outer, double depth,
                    int segments)
{
    struct shape_outline outline = {.count = 0};
    int steps = segments < SHAPE_OUTLINE_MAX / 2 - 1 ? segments : SHAPE_OUTLINE_MAX / 2 - 1;
    for (int i = 0; i <= steps; i++) {
        double angle = pi * i / steps;
        outline_push(&outline, radius_outer * cos(angle), radius_outer * sin(angle));
    }
    for (int i = steps; i >= 0; i--) {
        double angle = pi * i / steps;
        outline_push(&outline, radius_inner * cos(angle), radius_inner * sin(angle));
    }
    shape_add_extrusion(shape, &outline, depth);
}

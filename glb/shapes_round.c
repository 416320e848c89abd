/* SPDX-License-Identifier: MIT */
/* Pieces turned on a lathe: spheres, cylinders, cones, rings and vessels. */
#include "glb/shapes_internal.h"

#include <math.h>

static const double pi = 3.14159265358979323846;
static const double smooth_cosine = 0.819; /* corners below 35 degrees are smooth */

/* Outward normal (radius, y) of the segment from point i to the next. */
static void segment_normal(const struct shape_lathe_desc *desc, int i, double n[2])
{
    const double *a = desc->profile[i], *b = desc->profile[(i + 1) % desc->count];
    double length = hypot(b[0] - a[0], b[1] - a[1]);
    n[0] = length > 0 ? (b[1] - a[1]) / length : 0;
    n[1] = length > 0 ? (a[0] - b[0]) / length : 0;
}

/* Normal at one end of segment i: the mean with its neighbour where the corner is smooth. */
static void end_normal(const struct shape_lathe_desc *desc, int i, bool is_second_end, double n[2])
{
    int last = desc->is_closed ? desc->count : desc->count - 1;
    int neighbour = i + (is_second_end ? 1 : -1);
    segment_normal(desc, i, n);
    if (desc->is_closed)
        neighbour = (neighbour + last) % last;
    if (desc->is_faceted || neighbour < 0 || neighbour >= last)
        return;
    double other[2];
    segment_normal(desc, neighbour, other);
    if (n[0] * other[0] + n[1] * other[1] < smooth_cosine)
        return;
    n[0] += other[0];
    n[1] += other[1];
}

/* One circle of vertices; the seam is doubled so that u can run all the way round. */
static uint32_t add_circle(struct shape *shape, const double point[2], const double normal[2],
                           double radius_u, double v, int slices)
{
    uint32_t first = (uint32_t)shape->vertex_count;
    for (int i = 0; i <= slices; i++) {
        double angle = i == slices ? 0 : 2 * pi * i / slices, c = cos(angle), s = -sin(angle);
        double p[3] = {point[0] * c, point[1], point[0] * s};
        double n[3] = {normal[0] * c, normal[1], normal[0] * s};
        shape_add_vertex(shape, p, n, -2 * pi * i / slices * radius_u, v);
    }
    return first;
}

void shape_add_lathe(struct shape *shape, const struct shape_lathe_desc *desc)
{
    int segments = desc->is_closed ? desc->count : desc->count - 1;
    double v = 0, radius_u = 0;
    for (int i = 0; i < desc->count; i++)
        radius_u = fmax(radius_u, desc->profile[i][0]);
    for (int i = 0; i < segments; i++) {
        const double *a = desc->profile[i], *b = desc->profile[(i + 1) % desc->count];
        double na[2], nb[2], length = hypot(b[0] - a[0], b[1] - a[1]);
        end_normal(desc, i, false, na);
        end_normal(desc, i, true, nb);
        uint32_t low = add_circle(shape, a, na, radius_u, v, desc->slices);
        uint32_t high = add_circle(shape, b, nb, radius_u, v - length, desc->slices);
        v -= length;
        for (uint32_t k = 0; k < (uint32_t)desc->slices; k++) {
            if (a[0] > 0)
                shape_add_triangle(shape, low + k, low + k + 1, high + k + 1);
            if (b[0] > 0)
                shape_add_triangle(shape, low + k, high + k + 1, high + k);
        }
    }
}

/* Runs a lathe with its axis through center, then puts the place back. */
static void add_lathe_at(struct shape *shape, const double center[3],
                         const struct shape_lathe_desc *desc)
{
    struct shape before = *shape;
    if (shape->x[0] == 0 && shape->x[1] == 0 && shape->x[2] == 0)
        shape_set_place(shape, shape->origin, NULL, NULL);
    for (int i = 0; i < 3; i++)
        shape->origin[i] +=
            shape->x[i] * center[0] + shape->y[i] * center[1] + shape->z[i] * center[2];
    shape_add_lathe(shape, desc);
    for (int i = 0; i < 3; i++)
        shape->origin[i] = before.origin[i];
}

enum { STACKS_MAX = 128, SIDES_MAX = 64 };

void shape_add_sphere(struct shape *shape, const double center[3], double radius, int slices,
                      int stacks)
{
    double profile[STACKS_MAX + 1][2];
    int count = stacks < STACKS_MAX ? stacks : STACKS_MAX;
    for (int i = 0; i <= count; i++) {
        double angle = pi * i / count;
        bool is_pole = i == 0 || i == count;
        profile[i][0] = is_pole ? 0 : radius * sin(angle);
        profile[i][1] = -radius * cos(angle);
    }
    struct shape_lathe_desc lathe = {.profile = profile, .count = count + 1, .slices = slices};
    add_lathe_at(shape, center, &lathe);
}

void shape_add_cone(struct shape *shape, const double center[3], double radius_bottom,
                    double radius_top, double height, int slices)
{
    double profile[4][2] = {{0, 0}, {radius_bottom, 0}, {radius_top, height}, {0, height}};
    struct shape_lathe_desc lathe = {
        .profile = profile, .count = radius_top > 0 ? 4 : 3, .slices = slices};
    add_lathe_at(shape, center, &lathe);
}

void shape_add_cylinder(struct shape *shape, const double center[3], double radius, double height,
                        int slices)
{
    shape_add_cone(shape, center, radius, radius, height, slices);
}

void shape_add_torus(struct shape *shape, const double center[3], double radius, double thickness,
                     int slices, int sides)
{
    double profile[SIDES_MAX][2];
    int count = sides < SIDES_MAX ? sides : SIDES_MAX;
    for (int i = 0; i < count; i++) {
        double angle = 2 * pi * i / count;
        profile[i][0] = radius + thickness * cos(angle);
        profile[i][1] = thickness * sin(angle);
    }
    struct shape_lathe_desc lathe = {
        .profile = profile, .count = count, .is_closed = true, .slices = slices};
    add_lathe_at(shape, center, &lathe);
}

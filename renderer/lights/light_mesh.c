/* SPDX-License-Identifier: MIT */
/* Icosphere and capped cone as triangle soup. */
#include "renderer/lights/light_mesh.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "renderer/base/matrix.h"

struct mesh {
    float (*vertices)[4];
    int count;
};

static void add_vertex(struct mesh *mesh, double x, double y, double z, double w)
{
    float vertex[4] = {(float)x, (float)y, (float)z, (float)w};
    memcpy(mesh->vertices[mesh->count++], vertex, sizeof vertex);
}

static void middle_of(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] + b[i];
    bool ok = vec3_normalize(out);
    assert(ok);
}

/* Distance of the facet's plane from the centre: what the sphere must grow by to be enclosed. */
static double facet_distance(const double a[3], const double b[3], const double c[3])
{
    double ab[3], ac[3], normal[3];
    vec3_sub(b, a, ab);
    vec3_sub(c, a, ac);
    vec3_cross(ab, ac, normal);
    return vec3_dot(normal, a) / vec3_length(normal);
}

static void split_facet(struct mesh *mesh, int level, const double a[3], const double b[3],
                        const double c[3], double *inner)
{
    if (level == 0) {
        *inner = fmin(*inner, facet_distance(a, b, c));
        add_vertex(mesh, a[0], a[1], a[2], 0);
        add_vertex(mesh, b[0], b[1], b[2], 0);
        add_vertex(mesh, c[0], c[1], c[2], 0);
        return;
    }
    double ab[3], bc[3], ca[3];
    middle_of(a, b, ab);
    middle_of(b, c, bc);
    middle_of(c, a, ca);
    split_facet(mesh, level - 1, a, ab, ca, inner);
    split_facet(mesh, level - 1, ab, b, bc, inner);
    split_facet(mesh, level - 1, ca, bc, c, inner);
    split_facet(mesh, level - 1, ab, bc, ca, inner);
}

static void add_sphere(struct mesh *mesh)
{
    static const double t = 1.6180339887498949; /* golden ratio: corners of three rectangles */
    static const double corners[12][3] = {{-1, t, 0}, {1, t, 0}, {-1, -t, 0}, {1, -t, 0},
                                          {0, -1, t}, {0, 1, t}, {0, -1, -t}, {0, 1, -t},
                                          {t, 0, -1}, {t, 0, 1}, {-t, 0, -1}, {-t, 0, 1}};
    static const unsigned char facets[20][3] = {
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    double inner = 1;
    for (int f = 0; f < 20; f++) {
        double points[3][3];
        for (int k = 0; k < 3; k++) {
            memcpy(points[k], corners[facets[f][k]], sizeof points[k]);
            bool ok = vec3_normalize(points[k]);
            assert(ok);
        }
        split_facet(mesh, 2, points[0], points[1], points[2], &inner);
    }
    for (int i = 0; i < mesh->count; i++)
        for (int k = 0; k < 3; k++)
            mesh->vertices[i][k] /= (float)inner;
}

/* Ring 0 is the cap's pole, the last ring its rim. The polygon's growth lets its sides enclose the
 * circle, the radius' growth (half a ring's angle) lets the facets enclose the cap. */
static void add_ring_vertex(struct mesh *mesh, int ring, int segment)
{
    double growth = 1 / cos(M_PI / LIGHT_MESH_CONE_SEGMENTS);
    double azimuth = 2 * M_PI * (segment % LIGHT_MESH_CONE_SEGMENTS) / LIGHT_MESH_CONE_SEGMENTS;
    add_vertex(mesh, cos(azimuth) * growth, sin(azimuth) * growth,
               (double)ring / LIGHT_MESH_CONE_RINGS, 0.5 / LIGHT_MESH_CONE_RINGS);
}

static void add_cone(struct mesh *mesh)
{
    for (int s = 0; s < LIGHT_MESH_CONE_SEGMENTS; s++) {
        add_vertex(mesh, 0, 0, 0, -1);
        add_ring_vertex(mesh, LIGHT_MESH_CONE_RINGS, s + 1);
        add_ring_vertex(mesh, LIGHT_MESH_CONE_RINGS, s);
        for (int ring = 0; ring < LIGHT_MESH_CONE_RINGS; ring++) {
            add_ring_vertex(mesh, ring, s);
            add_ring_vertex(mesh, ring + 1, s);
            add_ring_vertex(mesh, ring + 1, s + 1);
            if (ring == 0)
                continue;
            add_ring_vertex(mesh, ring, s);
            add_ring_vertex(mesh, ring + 1, s + 1);
            add_ring_vertex(mesh, ring, s + 1);
        }
    }
}

void light_mesh_make(float vertices[LIGHT_MESH_VERTICES][4])
{
    struct mesh mesh = {.vertices = vertices};
    add_sphere(&mesh);
    assert(mesh.count == LIGHT_MESH_SPHERE_VERTICES);
    add_cone(&mesh);
    assert(mesh.count == LIGHT_MESH_VERTICES);
}

/* SPDX-License-Identifier: MIT */
/* Differentials of straight rays. */
#include "renderer/raytrace/rt_footprint.h"

#include <float.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_math.h"

static const double edge_on = 1e-9; /* least cosine: footprints far beyond any level of detail */

void rt_footprint_find(const struct rt_scene *scene, const struct rt_hit *hit,
                       const double way[2][3], const double direction[3],
                       struct rt_footprint *footprint)
{
    const struct rt_mesh *mesh = &scene->meshes[hit->mesh];
    double room[3][3], e1[3], e2[3], normal[3], across[2][3];
    const double *at[3];
    rt_mesh_corners(mesh, hit->triangle, room, at);
    vec3_sub(at[1], at[0], e1);
    vec3_sub(at[2], at[0], e2);
    vec3_cross(e1, e2, normal);
    vec3_cross(e2, normal, across[0]);
    vec3_cross(normal, e1, across[1]);
    double area = rt_max(vec3_dot(normal, normal), DBL_MIN);
    double facing = fabs(vec3_dot(normal, direction));
    facing = rt_max(facing, edge_on * sqrt(area * vec3_dot(direction, direction)));
    facing = vec3_dot(normal, direction) < 0 ? -facing : facing;
    for (int step = 0; step < 2; step++) {
        double slip = vec3_dot(normal, way[step]) / facing, move[3];
        double *out = step ? footprint->down : footprint->right;
        for (int k = 0; k < 3; k++)
            move[k] = way[step][k] - slip * direction[k];
        for (int k = 0; k < 2; k++)
            out[k] = vec3_dot(across[k], move) / area;
    }
}

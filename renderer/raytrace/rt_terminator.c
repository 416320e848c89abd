/* SPDX-License-Identifier: MIT */
/* The point moved towards the tangent planes of the triangle's vertices. */
#include "renderer/raytrace/rt_terminator.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_math.h"

static bool is_flat(const float *const normals[3])
{
    bool is_same = true;
    for (int k = 0; k < 3; k++)
        is_same = is_same && normals[0][k] == normals[1][k] && normals[0][k] == normals[2][k];
    return is_same;
}

bool rt_terminator_find(const struct rt_scene *scene, const struct rt_hit *hit,
                        const double point[3], struct rt_smooth_start *start)
{
    const struct rt_mesh *mesh = &scene->meshes[hit->mesh];
    const double weights[3] = {1 - hit->u - hit->v, hit->u, hit->v}, side = hit->is_front ? 1 : -1;
    const float *normals[3];
    uint32_t vertices[3];
    rt_mesh_triangle(mesh, hit->triangle, vertices);
    for (int i = 0; i < 3; i++)
        vertices[i] -= mesh->first_vertex;
    for (int i = 0; i < 3; i++)
        normals[i] = mesh->normals + 3 * (size_t)vertices[i];
    /* above a surface that diffuses light from behind, that light would be in its shadow */
    if (is_flat(normals) || mesh->material->diffuse_transmission > 0)
        return false;
    *start = (struct rt_smooth_start){.offset = {0}};
    for (int i = 0; i < 3; i++) {
        const double local[3] = {(double)normals[i][0], (double)normals[i][1],
                                 (double)normals[i][2]};
        double normal[3], at[3], away[3];
        for (int k = 0; k < 3; k++)
            normal[k] = side * vec3_dot(mesh->normal_matrix[k], local);
        if (!vec3_normalize(normal))
            return false;
        rt_mesh_vertex(mesh, vertices[i], at);
        vec3_sub(point, at, away);
        double below = rt_min(vec3_dot(away, normal), 0);
        for (int k = 0; k < 3; k++) {
            start->offset[k] -= weights[i] * below * normal[k];
            start->normal[k] += weights[i] * normal[k];
        }
    }
    return vec3_normalize(start->normal);
}

/* SPDX-License-Identifier: MIT */
/* Sixteen surfaces of one mesh side by side, without lobes over the base's: where rays meet them,
 * normals, starts of shadow rays, light that arrives, and what is reflected of it. All of it is
 * computed in the order of the scalar form (rt_scene_add_hit, rt_scene_normal, rt_surface_evaluate,
 * rt_terminator_find, rt_light_set_arrive, rt_reflect) and has its bits, whatever the other lanes
 * hold and however many of them a processor takes at a time. Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_WIDE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_WIDE_H

#include "renderer/raytrace/rt_light_set.h"
#include "renderer/raytrace/rt_reflect.h"

enum { RT_WIDE = 16 };

/* What all lanes have alike. */
struct rt_wide_mesh {
    double normal_matrix[3][3]; /* rt_mesh's, like is_mirrored */
    bool is_mirrored;
    bool is_smoothed;          /* starts of rays are moved as rt_terminator_find says */
    double origin[3], nudge_m; /* rt_scene's */
    double eye[3], back[3];    /* the camera's */
};

struct rt_wide {
    /* set by the caller; arrays of three are axes, before them the triangle's corners */
    _Alignas(64) double corners[3][3][RT_WIDE]; /* relative to rt_scene.origin */
    float normals[3][3][RT_WIDE];               /* of the mesh's vertices */
    double u[RT_WIDE], v[RT_WIDE], point[3][RT_WIDE], direction[3][RT_WIDE];
    double count[RT_WIDE]; /* that the five before are sums of */
    double side[RT_WIDE];  /* -1: the viewer sees the back */
    /* rt_wide_place */
    double middle[3][RT_WIDE], view[3][RT_WIDE], view_z[RT_WIDE];
    double normal[3][RT_WIDE]; /* rt_surface's */
    double start[3][RT_WIDE], offset[3][RT_WIDE];
    /* rt_wide_look or rt_wide_paint */
    double n_dot_v[RT_WIDE], seen[RT_WIDE];
    /* rt_wide_paint alone: rt_reflector's */
    double alpha_square[RT_WIDE], diffuse[3][RT_WIDE], diffuse_edge[3][RT_WIDE];
    double specular[3][RT_WIDE], specular_edge[3][RT_WIDE];
};

/* Sixteen rays side by side; members are those of struct rt_ray. */
struct rt_wide_rays {
    _Alignas(64) double origin[3][RT_WIDE], direction[3][RT_WIDE];
    double t_min[RT_WIDE], t_max[RT_WIDE];
};

/* Where each of the rays meets a triangle of its own. */
struct rt_wide_hits {
    _Alignas(64) double corners[3][3][RT_WIDE]; /* set by the caller; relative to rt_scene.origin */
    double turn[RT_WIDE];                       /* likewise; -1: of a mirrored mesh, else 1 */
    double t[RT_WIDE], u[RT_WIDE], v[RT_WIDE], point[3][RT_WIDE];
    double normal[3][RT_WIDE]; /* rt_scene_normal's; where the caller asks for it */
    uint32_t is_front[RT_WIDE];
    uint32_t is_met[RT_WIDE]; /* within the ray's range, and not edge on */
};

/* Light of one lamp on its way to the sixteen. */
struct rt_wide_light {
    _Alignas(64) float direction[3][RT_WIDE], distance_m[RT_WIDE]; /* rt_light_set_arrive's */
    double gain[RT_WIDE];
    uint32_t arrives[RT_WIDE];
    float weight[3][RT_WIDE]; /* rt_ray_job's, of those that reflect some */
    uint32_t reflects[RT_WIDE];
};

/* Whether the vertices of each of the first triangles have one normal. */
bool rt_wide_is_flat(const struct rt_wide *wide, int count);

/* Where rays from `origin` meet each of the triangles, which is known of them: sums of u, v, point
 * and direction, and the side, as rt_scene_add_hit has them. ways: of each sample. sought: 0 of
 * lanes that stay as they are. */
void rt_wide_find(const double origin[3], bool is_mirrored, int samples,
                  const double (*ways)[3][RT_WIDE], const uint32_t sought[RT_WIDE],
                  struct rt_wide *wide);

/* Points, views and normals, and where shadow rays begin. */
void rt_wide_place(const struct rt_wide_mesh *mesh, struct rt_wide *wide);

/* What the reflector of the first lane and those of the others do not have alike. */
void rt_wide_look(const struct rt_reflector *reflector, struct rt_wide *wide);

/* Makes a lane's reflector, with its normal, that of `reflector`, where each has its own. It has no
 * lobes, film, grain and transmission. */
void rt_wide_paint(const struct rt_reflector *reflector, int lane, struct rt_wide *wide);

/* direction, distance_m, gain and whether it arrives. Not of area lights. */
void rt_wide_arrive(const struct rt_light_record *record, const struct rt_wide *wide,
                    struct rt_wide_light *light);

/* reflects and weight. reflector: of the first lane, without lobes, film, grain and transmission;
 * NULL: each lane has its own. */
void rt_wide_reflect(const struct rt_reflector *reflector, const struct rt_light_record *record,
                     const struct rt_wide *wide, struct rt_wide_light *light);

/* All but corners and turn, as rt_scene_add_hit computes it. */
void rt_wide_meet(const struct rt_wide_rays *rays, struct rt_wide_hits *hits, bool has_normals);

/* Where shadow rays go, as production has them for one surface (rt_batch_light.c). */
struct rt_wide_way {
    double epsilon, size_m, nudge_m; /* rt_scene's */
};
void rt_wide_leave(const struct rt_wide_way *way, const struct rt_wide *wide,
                   const struct rt_wide_light *light, struct rt_wide_rays *rays);

/* Adds the light's weights, times what passes on the way, to the radiance of lanes that it
 * reaches. Both have three. */
void rt_wide_add(const struct rt_wide_light *light, const uint32_t reaches[RT_WIDE],
                 double (*passes)[RT_WIDE], double (*radiance)[RT_WIDE]);

#endif

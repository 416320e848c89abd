/* SPDX-License-Identifier: MIT */
/* The scene as rays see it: Embree finds candidate triangles in f32, hits are recomputed in f64. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_SCENE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_SCENE_H

#include <embree3/rtcore.h>

#include "renderer/scene/scene_state.h"

struct rt_mesh { /* one state item, triangles only */
    const struct state_item *item;
    double (*positions)[3]; /* relative to rt_scene.origin */
};

struct rt_scene {
    const struct scene_state *state;
    RTCDevice device;
    RTCScene scene;
    struct rt_mesh *meshes; /* by Embree geometry id */
    size_t mesh_count;
    double origin[3]; /* world; centre of the scene, so that f32 keeps its precision */
    double epsilon;   /* relative tolerance of "strictly nearer", as the rasteriser's */
    const double (*clip_planes)[4]; /* world; borrowed */
    size_t clip_plane_count;
};

struct rt_hit {
    double t;         /* along the ray, in units of its direction */
    double u, v;      /* barycentric weights of the second and third vertex */
    double normal[3]; /* geometric, unit, counter-clockwise side */
    uint32_t mesh, triangle;
    bool is_front; /* the ray's origin sees the front face */
};

/* Every hit of one ray with t in (t_min, t_max), nearest first; opaque surfaces end the list. */
enum { RT_HITS_MAX = 16384 };
struct rt_hits {
    struct rt_hit *hits; /* owned, capacity RT_HITS_MAX */
    size_t count;
    bool has_overflowed;
};

struct rt_ray {
    double origin[3], direction[3]; /* origin relative to rt_scene.origin */
    double t_min, t_max;
    bool culls_back_faces;             /* of single-sided materials, for camera rays */
    uint32_t skip_mesh, skip_triangle; /* the triangle that the ray starts on; UINT32_MAX: none */
};

MUST_CHECK bool rt_scene_init(struct rt_scene *scene, const struct scene_state *state,
                              const struct view *view, struct error *err);
void rt_scene_finish(struct rt_scene *scene);

/* Collects hits in order. Duplicates that Embree reports twice are dropped. */
void rt_scene_collect(const struct rt_scene *scene, const struct rt_ray *ray, struct rt_hits *hits);

/* The three vertex numbers (in the scene's streams) of a triangle. */
void rt_scene_triangle(const struct rt_scene *scene, uint32_t mesh, uint32_t triangle,
                       uint32_t vertices[3]);

/* Whether the surface ends a ray at the hit: opaque, or masked with enough alpha. */
bool rt_scene_is_opaque(const struct rt_scene *scene, const struct rt_hit *hit);

#endif

/* SPDX-License-Identifier: MIT */
/* The scene for ray tracing. Embree finds candidate triangles in f32, and hits are recomputed in
 * f64. Thread: built by one, then read by any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_SCENE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_SCENE_H

#include <stdatomic.h>
#include <string.h>

#include "renderer/raytrace/embree.h"
#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_mask.h"
#include "renderer/raytrace/rt_shape.h"
#include "renderer/raytrace/rt_texture.h"
#include "renderer/scene/scene_state.h"

struct rt_mesh { /* one state item, triangles only */
    const struct state_item *item;
    double (*positions)[3];    /* owned; relative to rt_scene.origin. NULL: it is an instance */
    const float *local;        /* the mesh's first vertex; borrowed from the scene */
    const double *origin;      /* rt_scene.origin */
    const uint32_t *triangles; /* three numbers of positions each; borrowed from the scene */
    /* what each hit asks for, at hand */
    enum state_class class_;
    bool is_mirrored, is_medium, is_double_sided, is_ground;
    enum state_bend bend;                    /* NONE where the view wants none */
    const struct scene_material *material;   /* of the state */
    const struct scene_primitive *primitive; /* a cap's own */
    const struct scene *streams;             /* texture coordinates and colours ... */
    uint32_t first_vertex;                   /* ... from this vertex on */
    const float *normals, *tangents;         /* from the mesh's first vertex on, as positions */
    const double *world;                     /* 4 x 4: of tangents to world */
    double normal_matrix[3][3];              /* of normals to world, up to a positive scale */
    uint64_t place;                          /* key of where its vertices are */
    bool fits;                               /* rt_shape_fits */
    uint32_t node;
    bool no_self_shadow, cast_once; /* of the material */
    uint32_t slots;                 /* 1 << enum scene_texture_slot: those that are sampled */
    bool is_bare, is_plain;         /* rt_surface_is_bare, rt_surface_is_plain */
    bool is_filter_plain;           /* every crossing multiplies light by `filter`, at any angle */
    double filter[3];
    bool is_sheet; /* is_filter_plain, and nothing else depends on how often and where it is crossed
                    */
};

/* The three vertex numbers (in the mesh's streams) of a triangle. */
static inline void rt_mesh_triangle(const struct rt_mesh *mesh, uint32_t triangle,
                                    uint32_t vertices[3])
{
    for (size_t k = 0; k < 3; k++)
        vertices[k] = mesh->first_vertex + mesh->triangles[3 * (size_t)triangle + k];
}

/* A vertex of the mesh, by the numbers of its triangles, relative to rt_scene.origin. */
static inline void rt_mesh_vertex(const struct rt_mesh *mesh, uint32_t vertex, double out[3])
{
    if (mesh->positions) {
        memcpy(out, mesh->positions[vertex], sizeof *mesh->positions);
        return;
    }
    const float *p = mesh->local + 3 * (size_t)vertex;
    double world[3];
    mat4_transform_point(mesh->world, (const double[3]){(double)p[0], (double)p[1], (double)p[2]},
                         world);
    vec3_sub(world, mesh->origin, out);
}

/* Those of a triangle, where they lie: in `room` if the mesh has none at hand. */
static inline void rt_mesh_corners(const struct rt_mesh *mesh, uint32_t triangle, double room[3][3],
                                   const double *corners[3])
{
    const uint32_t *vertices = mesh->triangles + 3 * (size_t)triangle;
    for (size_t k = 0; k < 3; k++)
        corners[k] = mesh->positions ? mesh->positions[vertices[k]] : room[k];
    for (size_t k = 0; k < 3 && !mesh->positions; k++)
        rt_mesh_vertex(mesh, vertices[k], room[k]);
}

/* The mesh of what Embree hit: an instance's, or a geometry of the scene itself. */
static inline uint32_t rt_mesh_of_hit(uint32_t geometry, uint32_t instance)
{
    return instance == RTC_INVALID_GEOMETRY_ID ? geometry : instance;
}

struct rt_scene {
    const struct scene_state *state;
    RTCDevice device;
    RTCScene scene;
    struct rt_mesh *meshes; /* by the id of a geometry or an instance in Embree's scene */
    size_t mesh_count;
    struct rt_shapes shapes;
    struct rt_mask *masks; /* by image; of those that masked materials take their alpha from */
    size_t mask_count;
    uint64_t key;       /* of the geometry: what the Embree scene was built from */
    uint64_t structure; /* the same, wherever it stands */
    bool is_dynamic;    /* meshes have hierarchies of their own: rt_scene_move */
    int lanes;          /* rays that the processor traces together: 16, 8 or 1 */
    atomic_llong embree_bytes;
    uint64_t vertex_bytes;
    double origin[3];        /* world; centre of the scene, so that f32 keeps its precision */
    double epsilon;          /* relative tolerance of "strictly nearer", as the rasteriser's */
    double size_m;           /* rays to lights infinitely far away are this long */
    double nudge_m;          /* how far f32 may misplace a point of the scene */
    struct rt_image *images; /* of the state's scene */
    struct rt_texel_tables tables;
    const double (*clip_planes)[4]; /* world; borrowed */
    size_t clip_plane_count;
    const struct view_cut *cuts; /* per clip plane; NULL: the default; borrowed */
};

struct rt_hit {
    double t;    /* along the ray, in units of its direction */
    double u, v; /* barycentric weights of the second and third vertex */
    uint32_t mesh, triangle;
    bool is_front;       /* the ray's origin sees the front face */
    bool is_opaque;      /* ends the ray: opaque, or masked with enough alpha, and not hidden */
    bool is_hidden;      /* not drawn (a culled face, or clipped away): it only bounds its medium */
    bool is_left_unseen; /* hidden as the culled face of a medium, or of a solid that refracts: what
                            leaves there is filtered */
};

/* Every hit of one ray with t in (t_min, t_max), nearest first; opaque surfaces end the list. */
enum { RT_HITS_MAX = 16384 };
struct rt_hits {
    struct rt_hit *hits; /* owned, one more than RT_HITS_MAX; pages are touched when needed */
    size_t count;
    bool has_overflowed;
};
MUST_CHECK bool rt_hits_init(struct rt_hits *hits, struct error *err);
void rt_hits_finish(struct rt_hits *hits); /* accepts zeroed */

struct rt_ray {
    double origin[3], direction[3]; /* origin relative to rt_scene.origin */
    double t_min, t_max;
    bool culls_back_faces;             /* of single-sided materials: it is a camera ray, which all
                                          clip planes cut */
    bool is_bent;                      /* it began at a surface: nothing before t_min counts */
    bool only_media;                   /* through everything, keeping surfaces of media */
    uint32_t skip_mesh, skip_triangle; /* the triangle that the ray starts on; UINT32_MAX: none */
    uint32_t excluded_node; /* a node, and one, whose filters and media do not count; 0: none */
};

MUST_CHECK bool rt_scene_init(struct rt_scene *scene, const struct scene_state *state,
                              const struct view *view, struct error *err);
void rt_scene_finish(struct rt_scene *scene); /* accepts zeroed */

/* Takes a built scene over to another state and view of the same scene file: false, and nothing
 * happens, when its geometry is another. */
bool rt_scene_rebind(struct rt_scene *scene, const struct scene_state *state,
                     const struct view *view);

/* Has what moved or bent since the scene was built built anew, and nothing else; rays find the same
 * as in a new scene. False where more than that changed, the bounds of everything too, or without
 * memory: then it has to be built anew. */
bool rt_scene_move(struct rt_scene *scene, const struct scene_state *state,
                   const struct view *view);

/* texture_levels: of struct raytrace_desc; until the next rebinding. */
void rt_scene_withhold(struct rt_scene *scene, const uint8_t *texture_levels);

uint64_t rt_scene_size_bytes(const struct rt_scene *scene);

/* Has what rt_scene_add_hit reads of a triangle brought into the cache: ask for several triangles
 * before the first is added. Step 0, for all of them, then step 1. */
static inline void rt_scene_prefetch(const struct rt_scene *scene, uint32_t mesh, uint32_t triangle,
                                     int step)
{
    const struct rt_mesh *m = &scene->meshes[mesh];
    const uint32_t *index = m->triangles + 3 * (size_t)triangle;
    if (step == 0) {
        __builtin_prefetch(index);
        return;
    }
    for (int k = 0; k < 3; k++)
        __builtin_prefetch(m->positions ? (const void *)m->positions[index[k]]
                                        : m->local + 3 * (size_t)index[k]);
}

/* Adds a candidate triangle to the hits, recomputed in f64, if the ray counts it. Returns whether
 * it ends the ray. */
bool rt_scene_add_hit(const struct rt_scene *scene, const struct rt_ray *ray, uint32_t mesh,
                      uint32_t triangle, struct rt_hits *hits);

/* Sorts the hits; one crossing counts once, also where Embree reports a triangle twice or the ray
 * runs through an edge or corner that triangles of one surface share; cuts after the first opaque
 * surface. */
void rt_scene_order_hits(const struct rt_scene *scene, struct rt_hits *hits);

/* Where the ray is inside all clip planes that count for it, in units of its direction; those of
 * shadow rays let light in. Empty: the same number twice. */
void rt_scene_kept_range(const struct rt_scene *scene, const struct rt_ray *ray, double range[2]);

/* Both of the above for all that the ray meets. */
void rt_scene_collect(const struct rt_scene *scene, const struct rt_ray *ray, struct rt_hits *hits);

/* The triangle's unit normal, on its counter-clockwise side; zero for one without area. */
void rt_scene_normal(const struct rt_scene *scene, const struct rt_hit *hit, double normal[3]);

#endif

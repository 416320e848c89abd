/* SPDX-License-Identifier: MIT */
/* Triangles of sheets (rt_mesh.is_sheet) that many rays of a packet cross, each kept once for all
 * of them, in f32 and side by side. Internal to rt_packet. Thread: one per packet. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_CROSSING_H
#define VITRAIL_RENDERER_RAYTRACE_RT_CROSSING_H

#include "renderer/base/processor_forms.h"
#include "renderer/raytrace/rt_scene.h"

enum { RT_LANES = 16, RT_CROSSINGS_MAX = 12 };

/* Where a packet's parts lie (rtcore_ray.h of Embree 3 and 4): arrays of N in the order of the
 * members of RTCRay and RTCHit. The header has accessors for C++ only. */
enum {
    RT_RAY_ORIGIN = 0,
    RT_RAY_TNEAR = 3,
    RT_RAY_DIRECTION = 4,
    RT_RAY_TFAR = 8,
    RT_RAY_MASK = 9,
    RT_RAY_ID = 10,
    RT_RAY_MEMBERS = 12,
    RT_HIT_U = 3,
    RT_HIT_TRIANGLE = 5,
    RT_HIT_MESH = 6,
    RT_HIT_INSTANCE = 7,
    RT_HIT_MEMBERS = 8,
};

/* What f32 says of how a ray meets a triangle. */
enum {
    RT_MEETS_FRONT = 1,   /* of what the mesh calls its front */
    RT_MEETS_LEANING = 2, /* its side is beyond doubt */
    RT_MEETS_STEEP = 4,   /* and so is its place within rt_crossing_apart_m */
    RT_MEETS_INSIDE = 8,  /* not at its border; of transparent ones alone */
    RT_MEETS_CLEARLY = RT_MEETS_STEEP | RT_MEETS_INSIDE,
};

/* along: the product of normal and direction; square: of their lengths' squares. */
INSIDE_FORMS uint32_t rt_meets(float along, float square)
{
    static const float leaning_cosine = 1e-4f, steep_cosine = 0.05f;
    const float along2 = along * along;
    uint32_t front = along < 0 ? RT_MEETS_FRONT : 0;
    uint32_t leaning = along2 > leaning_cosine * leaning_cosine * square ? RT_MEETS_LEANING : 0;
    uint32_t steep = along2 > steep_cosine * steep_cosine * square ? RT_MEETS_STEEP : 0;
    return front | leaning | steep;
}

/* Whether a ray crosses a triangle away from its border. */
INSIDE_FORMS uint32_t rt_meets_inside(float u, float v)
{
    static const float border = 1e-3f; /* share of a side */
    uint32_t is_inside = (u > border) & (v > border) & (u + v < 1 - border);
    return is_inside ? RT_MEETS_INSIDE : 0;
}

/* Of the mesh, not of the normal that Embree has. 0: of instances nothing is known. */
static inline uint32_t rt_mesh_meets(const struct rt_mesh *mesh, uint32_t meets)
{
    return mesh->positions ? meets ^ (mesh->is_mirrored ? RT_MEETS_FRONT : 0) : 0;
}

/* How far apart sheets are in an order that f32 tells beyond doubt, where they are met steeply. */
static inline double rt_crossing_apart_m(const struct rt_scene *scene)
{
    return 160 * scene->nudge_m;
}

struct rt_crossing {
    float t[RT_LANES];            /* along each ray; infinite: it does not cross */
    uint32_t meets[RT_LANES];     /* RT_MEETS_* */
    uint32_t is_before[RT_LANES]; /* out of rt_crossings_order: it crosses before the ray's end */
    uint32_t mesh, triangle;
    uint32_t least; /* the bits of the least t */
};

struct rt_crossings { /* zeroed before the first one */
    _Alignas(64) struct rt_crossing crossings[RT_CROSSINGS_MAX];
    int count;
    int order[RT_CROSSINGS_MAX]; /* out of rt_crossings_order, front to back */
};

/* Keeps what a filter of Embree's is shown. lanes: 1 << lane of those that it is about, at least
 * one; first: the packet's lane of Embree's ray 0. False, and nothing is kept, where it is no
 * sheet, few rays cross it, or there are too many. */
bool rt_crossings_keep(struct rt_crossings *crossings, const struct rt_scene *scene,
                       const struct RTCFilterFunctionNArguments *args, uint32_t lanes,
                       uint32_t first);

/* Puts all in the order in which each ray crosses them. Returns 1 << lane of those rays of which it
 * holds beyond doubt, as rt_packet_sheets has it for one. */
uint32_t rt_crossings_order(struct rt_crossings *crossings, double apart_m,
                            const double t_min[RT_LANES], const double t_max[RT_LANES]);

#endif

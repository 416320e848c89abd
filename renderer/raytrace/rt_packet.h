/* SPDX-License-Identifier: MIT */
/* A packet of sixteen rays. Embree traverses its tree in f32 for as many of them at a time as the
 * processor has lanes (rt_scene.lanes). Every transparent surface that a ray meets is recomputed in
 * f64 and kept. Thread: one per packet. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_PACKET_H
#define VITRAIL_RENDERER_RAYTRACE_RT_PACKET_H

#include "renderer/raytrace/rt_scene.h"

enum { RT_LANES = 16, RT_WAITING_MAX = 24 };

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
    RT_HIT_TRIANGLE = 5,
    RT_HIT_MESH = 6,
    RT_HIT_INSTANCE = 7,
    RT_HIT_MEMBERS = 8,
};

struct rt_candidate { /* a triangle that Embree found on a ray */
    float t;
    uint32_t mesh, triangle;
};

struct rt_packet { /* zeroed before init */
    const struct rt_scene *scene;
    struct rt_ray rays[RT_LANES];  /* set by the caller; the first `count` are traced */
    struct rt_hits hits[RT_LANES]; /* out, in order; parts of one allocation, the first one's */
    bool is_occluded[RT_LANES];    /* out of rt_packet_occlude: an opaque surface is between */
    int count;
    struct rt_candidate ends[RT_LANES]; /* of each ray: its nearest opaque one; mesh may be none */
    struct rt_candidate waiting[RT_LANES][RT_WAITING_MAX]; /* transparent, until the end is known */
    int waiting_counts[RT_LANES];
    struct rt_query *query; /* owned; rays as Embree has them */
    int wary; /* so many rays more look at each opaque hit: a ray met one that it passes */
};

MUST_CHECK bool rt_packet_init(struct rt_packet *packet, const struct rt_scene *scene,
                               struct error *err);
void rt_packet_finish(struct rt_packet *packet); /* accepts zeroed */

/* All hits of each ray up to its first opaque one, which is the last. */
void rt_packet_collect(struct rt_packet *packet);

/* Whether an opaque surface lies on each ray, and where not, all its hits. Opaque surfaces are
 * found in f32: origins must lie clear of the receiver's own surface (rt_scene.nudge_m). */
void rt_packet_occlude(struct rt_packet *packet);

/* Of geometries that are not opaque; rt_scene sets it. */
void rt_packet_filter(const struct RTCFilterFunctionNArguments *args);

#endif

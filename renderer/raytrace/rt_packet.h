/* SPDX-License-Identifier: MIT */
/* A packet of sixteen rays. Embree traverses its tree in f32 for as many of them at a time as the
 * processor has lanes (rt_scene.lanes). Every transparent surface that a ray meets is recomputed in
 * f64 and kept. Thread: one per packet. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_PACKET_H
#define VITRAIL_RENDERER_RAYTRACE_RT_PACKET_H

#include "renderer/raytrace/rt_crossing.h"
#include "renderer/raytrace/rt_scene.h"
#include "renderer/raytrace/rt_wide.h"

enum { RT_WAITING_MAX = 24 };

struct rt_candidate { /* a triangle that Embree found on a ray */
    float t;
    uint32_t mesh, triangle;
    uint32_t meets; /* RT_MEETS_*; 0 of instances */
};

static inline bool rt_candidate_is_same(const struct rt_candidate *a, const struct rt_candidate *b)
{
    return a->mesh == b->mesh && a->triangle == b->triangle;
}

/* Makes one ray of a packet, the same that Embree was given in f32. */
typedef void rt_packet_maker(const void *from, int lane, struct rt_ray *ray);

struct rt_packet { /* zeroed before init */
    const struct rt_scene *scene;
    struct rt_ray rays[RT_LANES];  /* set by the caller; the first `count` are traced */
    struct rt_hits hits[RT_LANES]; /* out, in order; parts of one allocation, the first one's */
    bool is_occluded[RT_LANES];    /* out of rt_packet_occlude: an opaque surface is between */
    int count;
    uint32_t used;  /* 1 << lane of those that may have hits, or transparent ones that wait */
    uint32_t ended; /* likewise of those that have an end */
    uint32_t made;  /* likewise of rays that are in their places */
    rt_packet_maker *make;              /* of the others, when one is asked for (rt_packet_ray) */
    const void *from;                   /* for make */
    struct rt_candidate ends[RT_LANES]; /* of each ray: its nearest opaque one; mesh may be none */
    struct rt_candidate waiting[RT_LANES][RT_WAITING_MAX]; /* transparent, until the end is known */
    int waiting_counts[RT_LANES];
    struct rt_query *query; /* owned; rays as Embree has them */
    /* owned; sheets that many rays cross, in place of `waiting` until rt_packet_spread */
    struct rt_crossings *crossings;
    uint32_t single; /* 1 << lane of those of which something is not in crossings */
    int wary;        /* so many rays more look at each opaque hit: a ray met one that it passes */
};

MUST_CHECK bool rt_packet_init(struct rt_packet *packet, const struct rt_scene *scene,
                               struct error *err);
void rt_packet_finish(struct rt_packet *packet); /* accepts zeroed */

/* All hits of each ray up to its first opaque one, which is the last. */
void rt_packet_collect(struct rt_packet *packet);

/* Whether an opaque surface lies on each ray, and where not, all its hits. Opaque surfaces are
 * found in f32: origins must lie clear of the receiver's own surface (rt_scene.nudge_m). */
void rt_packet_occlude(struct rt_packet *packet);

/* The same two for rays side by side, of which few are looked at one by one: `make` and `from` are
 * set by the caller in place of the rays. */

/* Whether some camera ray may have to look at each opaque hit, so that they are to be collected. */
bool rt_packet_is_wary(const struct rt_packet *packet);
/* Finds the nearest opaque surface of each camera ray, and what may lie before it: what is in
 * crossings has to be spread before a lane is asked for. */
void rt_packet_seek(struct rt_packet *packet, const struct rt_wide_rays *rays);
/* 1 << lane of those found to meet nothing but an opaque surface, in f32. */
static inline uint32_t rt_packet_plain_ends(const struct rt_packet *packet)
{
    return packet->ended & ~packet->used;
}
/* And of those that meet nothing. */
static inline uint32_t rt_packet_empty(const struct rt_packet *packet)
{
    return ~(packet->ended | packet->used) & ((1u << packet->count) - 1);
}
/* Puts what those lanes cross where it waits for each of them. Crossings are forgotten. */
void rt_packet_spread(struct rt_packet *packet, uint32_t lanes);
/* What f32 says of the end of a ray that has one, with what the mesh calls its front. */
static inline uint32_t rt_packet_end_meets(const struct rt_packet *packet, int lane)
{
    const struct rt_candidate *end = &packet->ends[lane];
    return rt_mesh_meets(&packet->scene->meshes[end->mesh], end->meets);
}
/* After rt_packet_seek: how many sheets lie before the end of a ray that ends on an opaque surface
 * or at nothing. They are in order in `waiting`, each triangle once, and with the end they are what
 * rt_packet_collect_one would find. -1: f32 does not tell, and that is to be asked. */
int rt_packet_sheets(struct rt_packet *packet, const struct rt_wide_rays *rays, int lane);
/* Where it has such an end. */
bool rt_packet_end_is_front(const struct rt_packet *packet, int lane);
/* After rt_packet_seek: all hits of one ray, as rt_packet_collect has them. */
void rt_packet_collect_one(struct rt_packet *packet, int lane);

/* lanes: 1 << lane of those to trace. Returns those that are not occluded; their hits are there.
 * passes: NULL, or in and out: of lanes whose way needs no hits, what its filters let through is
 * multiplied to these three; they are no longer `used`. */
uint32_t rt_packet_pass(struct rt_packet *packet, const struct rt_wide_rays *rays, uint32_t lanes,
                        double (*passes)[RT_WIDE]);

static inline const struct rt_ray *rt_packet_ray(struct rt_packet *packet, int lane)
{
    if (!(packet->made >> lane & 1)) {
        packet->make(packet->from, lane, &packet->rays[lane]);
        packet->made |= 1u << lane;
    }
    return &packet->rays[lane];
}

/* Of geometries that are not opaque; rt_scene sets it. */
void rt_packet_filter(const struct RTCFilterFunctionNArguments *args);

#endif

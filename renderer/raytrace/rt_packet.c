/* SPDX-License-Identifier: MIT */
/* Packets of rays, and the filter that keeps what they cross. */
#include "renderer/raytrace/rt_packet.h"

#include <float.h>
#include <math.h>
#include <string.h>

struct packet_context { /* Embree hands its first member to filters */
    struct RTCIntersectContext embree;
    struct rt_packet *packet;
};

/* Where a packet's parts lie (Embree 3, rtcore_ray.h): arrays of N in the order of the members of
 * RTCRay and RTCHit. The header has accessors for C++ only. */
enum { RAY_DIRECTION = 4, RAY_TFAR = 8, RAY_ID = 10, HIT_TRIANGLE = 5, HIT_MESH = 6 };

static uint32_t packet_word(const void *packet, unsigned n, unsigned member, unsigned lane)
{
    return ((const uint32_t *)packet)[member * n + lane];
}

static float packet_float(const void *packet, unsigned n, unsigned member, unsigned lane)
{
    return ((const float *)packet)[member * n + lane];
}

/* Whether a camera ray certainly ends at this candidate, as most do: an opaque face that looks its
 * way, beyond the near plane. Only the last of these is recomputed, when the packet is through. */
static bool is_plain_end(const struct rt_packet *packet,
                         const struct RTCFilterFunctionNArguments *args, unsigned i,
                         const struct rt_ray *ray)
{
    const struct rt_scene *scene = packet->scene;
    const struct state_item *item =
        scene->meshes[packet_word(args->hit, args->N, HIT_MESH, i)].item;
    if (!ray->culls_back_faces || item->class_ != STATE_OPAQUE || scene->clip_plane_count)
        return false;
    double t = (double)packet_float(args->ray, args->N, RAY_TFAR, i);
    if (t < ray->t_min * 1.0001 || t * 1.0001 > ray->t_max)
        return false;
    double along = 0, square = 0;
    for (unsigned k = 0; k < 3; k++) { /* the hit's first members are its normal */
        double n = (double)packet_float(args->hit, args->N, k, i);
        double d = (double)packet_float(args->ray, args->N, RAY_DIRECTION + k, i);
        along += n * d;
        square += n * n * d * d;
    }
    if (item->is_mirrored)
        along = -along;
    return along < 0 && along * along > 1e-8 * square;
}

/* Lanes are told by their ray id, because Embree also filters parts of a packet. */
static void filter_lanes(const struct RTCFilterFunctionNArguments *args)
{
    struct rt_packet *packet = ((struct packet_context *)args->context)->packet;
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] != -1)
            continue;
        uint32_t lane = packet_word(args->ray, args->N, RAY_ID, i);
        if (is_plain_end(packet, args, i, &packet->rays[lane]))
            continue;
        bool ends = rt_scene_add_hit(
            packet->scene, &packet->rays[lane], packet_word(args->hit, args->N, HIT_MESH, i),
            packet_word(args->hit, args->N, HIT_TRIANGLE, i), &packet->hits[lane]);
        args->valid[i] = ends ? -1 : 0;
    }
}

/* A filter of the context sees all hits; that of the geometry then leaves them to it. */
void rt_packet_filter(const struct RTCFilterFunctionNArguments *args)
{
    if (!args->context->filter)
        filter_lanes(args);
}

bool rt_packet_init(struct rt_packet *packet, const struct rt_scene *scene, struct error *err)
{
    packet->scene = scene;
    for (int i = 0; i < RT_LANES; i++)
        if (!rt_hits_init(&packet->hits[i], err))
            return false;
    return true;
}

void rt_packet_finish(struct rt_packet *packet)
{
    for (int i = 0; i < RT_LANES; i++)
        rt_hits_finish(&packet->hits[i]);
}

/* t beyond t_max by a little where the filter decides in f64. */
static void fill_lane(struct RTCRay8 *rays, int lane, const struct rt_ray *ray, double slack)
{
    rays->org_x[lane] = (float)ray->origin[0];
    rays->org_y[lane] = (float)ray->origin[1];
    rays->org_z[lane] = (float)ray->origin[2];
    rays->dir_x[lane] = (float)ray->direction[0];
    rays->dir_y[lane] = (float)ray->direction[1];
    rays->dir_z[lane] = (float)ray->direction[2];
    rays->tnear[lane] = slack > 0 ? 0 : (float)ray->t_min;
    rays->tfar[lane] = ray->t_max < (double)FLT_MAX ? (float)(ray->t_max * (1 + slack)) : FLT_MAX;
    rays->mask[lane] = UINT32_MAX;
    rays->id[lane] = (unsigned)lane;
}

static struct RTCRay lane_ray(const struct RTCRay8 *rays, int lane)
{
    return (struct RTCRay){.org_x = rays->org_x[lane],
                           .org_y = rays->org_y[lane],
                           .org_z = rays->org_z[lane],
                           .dir_x = rays->dir_x[lane],
                           .dir_y = rays->dir_y[lane],
                           .dir_z = rays->dir_z[lane],
                           .tnear = rays->tnear[lane],
                           .tfar = rays->tfar[lane],
                           .mask = rays->mask[lane],
                           .id = rays->id[lane]};
}

static void begin(struct rt_packet *packet, struct RTCRay8 *rays, int valid[RT_LANES], double slack)
{
    for (int i = 0; i < RT_LANES; i++) {
        valid[i] = i < packet->count ? -1 : 0;
        packet->hits[i].count = 0;
        packet->hits[i].has_overflowed = false;
        if (valid[i])
            fill_lane(rays, i, &packet->rays[i], slack);
    }
}

void rt_packet_collect(struct rt_packet *packet)
{
    struct packet_context context = {.packet = packet};
    _Alignas(32) struct RTCRayHit8 query = {0};
    _Alignas(32) int valid[RT_LANES];
    begin(packet, &query.ray, valid, 1e-4);
    rtcInitIntersectContext(&context.embree);
    context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    context.embree.filter = filter_lanes;
    if (packet->scene->has_packets) {
        for (int i = 0; i < RT_LANES; i++)
            query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect8(valid, packet->scene->scene, &context.embree, &query);
    }
    for (int i = 0; !packet->scene->has_packets && i < packet->count; i++) {
        struct RTCRayHit one = {.ray = lane_ray(&query.ray, i),
                                .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
        rtcIntersect1(packet->scene->scene, &context.embree, &one);
        query.hit.geomID[i] = one.hit.geomID;
        query.hit.primID[i] = one.hit.primID;
    }
    for (int i = 0; i < packet->count; i++) {
        /* the end of the ray; where the filter kept it already, it is known twice */
        if (query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID)
            rt_scene_add_hit(packet->scene, &packet->rays[i], query.hit.geomID[i],
                             query.hit.primID[i], &packet->hits[i]);
        rt_scene_order_hits(packet->scene, &packet->hits[i]);
    }
}

void rt_packet_occlude(struct rt_packet *packet)
{
    struct packet_context context = {.packet = packet};
    _Alignas(32) struct RTCRay8 rays = {0};
    _Alignas(32) int valid[RT_LANES];
    begin(packet, &rays, valid, 0);
    rtcInitIntersectContext(&context.embree);
    context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    if (packet->scene->clip_plane_count)
        context.embree.filter = filter_lanes;
    if (packet->scene->has_packets)
        rtcOccluded8(valid, packet->scene->scene, &context.embree, &rays);
    for (int i = 0; !packet->scene->has_packets && i < packet->count; i++) {
        struct RTCRay one = lane_ray(&rays, i);
        rtcOccluded1(packet->scene->scene, &context.embree, &one);
        rays.tfar[i] = one.tfar;
    }
    for (int i = 0; i < packet->count; i++) {
        packet->is_occluded[i] = rays.tfar[i] < 0; /* -inf, says Embree */
        if (!packet->is_occluded[i])
            rt_scene_order_hits(packet->scene, &packet->hits[i]);
    }
}

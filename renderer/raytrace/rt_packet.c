/* SPDX-License-Identifier: MIT */
/* Packets of rays, and the filter that keeps what they cross. */
#include "renderer/raytrace/rt_packet.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
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

/* Clip planes cut opaque surfaces too, and media are entered before the camera's near plane. */
static bool filters_all(const struct rt_packet *packet)
{
    return packet->wary || packet->scene->clip_plane_count || packet->scene->state->medium_count;
}

/* Whether a camera ray certainly ends at this opaque candidate, as most do: a face that looks its
 * way, beyond the near plane. Only the last of these is recomputed, when the packet is through. */
static bool is_plain_end(const struct rt_packet *packet,
                         const struct RTCFilterFunctionNArguments *args, unsigned i,
                         const struct rt_ray *ray, bool is_mirrored)
{
    if (!ray->culls_back_faces || packet->scene->clip_plane_count)
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
    if (is_mirrored)
        along = -along;
    return along < 0 && along * along > 1e-8 * square;
}

/* Keeps a transparent candidate for when the ray's end is known: most rays of a shadow end at an
 * opaque surface, and then it does not count. */
static bool put_aside(struct rt_packet *packet, uint32_t lane, const struct rt_candidate *candidate)
{
    int *count = &packet->waiting_counts[lane];
    if (*count == RT_WAITING_MAX)
        return false;
    packet->waiting[lane][(*count)++] = *candidate;
    rt_scene_prefetch(packet->scene, candidate->mesh, candidate->triangle, 0);
    return true;
}

/* Whether the candidate ends its ray. */
static bool filter_lane(struct rt_packet *packet, const struct RTCFilterFunctionNArguments *args,
                        unsigned i)
{
    uint32_t lane = packet_word(args->ray, args->N, RAY_ID, i);
    const struct rt_candidate candidate = {packet_float(args->ray, args->N, RAY_TFAR, i),
                                           packet_word(args->hit, args->N, HIT_MESH, i),
                                           packet_word(args->hit, args->N, HIT_TRIANGLE, i)};
    const struct rt_mesh *mesh = &packet->scene->meshes[candidate.mesh];
    if (mesh->class_ == STATE_TRANSPARENT && put_aside(packet, lane, &candidate))
        return false;
    if (mesh->class_ == STATE_OPAQUE &&
        is_plain_end(packet, args, i, &packet->rays[lane], mesh->is_mirrored))
        return true;
    return rt_scene_add_hit(packet->scene, &packet->rays[lane], candidate.mesh, candidate.triangle,
                            &packet->hits[lane]);
}

/* Lanes are told by their ray id, because Embree also filters parts of a packet. */
static void filter_lanes(const struct RTCFilterFunctionNArguments *args)
{
    struct rt_packet *packet = ((struct packet_context *)args->context)->packet;
    for (unsigned i = 0; i < args->N; i++)
        if (args->valid[i] == -1)
            args->valid[i] = filter_lane(packet, args, i) ? -1 : 0;
}

/* A filter of the context sees all hits; that of the geometry then leaves them to it. */
void rt_packet_filter(const struct RTCFilterFunctionNArguments *args)
{
    if (!args->context->filter)
        filter_lanes(args);
}

bool rt_packet_init(struct rt_packet *packet, const struct rt_scene *scene, struct error *err)
{
    size_t per_lane = RT_HITS_MAX + 64 / sizeof(struct rt_hit) + 1; /* the lanes' first hits lie in
                                                                        different cache lines of a
                                                                       page */
    struct rt_hit *hits = aligned_alloc(64, RT_LANES * per_lane * sizeof *hits);
    if (!hits)
        return error_set(err, ERROR_NO_MEMORY, "hits of a packet of rays");
    packet->scene = scene;
    for (size_t i = 0; i < RT_LANES; i++)
        packet->hits[i].hits = hits + i * per_lane;
    return true;
}

void rt_packet_finish(struct rt_packet *packet)
{
    free(packet->hits[0].hits);
    memset(packet->hits, 0, sizeof packet->hits);
}

/* slack: how far beyond both ends hits are wanted, because f64 decides about them, over t. */
static void fill_lane(struct RTCRay8 *rays, int lane, const struct rt_ray *ray, double slack)
{
    rays->org_x[lane] = (float)ray->origin[0];
    rays->org_y[lane] = (float)ray->origin[1];
    rays->org_z[lane] = (float)ray->origin[2];
    rays->dir_x[lane] = (float)ray->direction[0];
    rays->dir_y[lane] = (float)ray->direction[1];
    rays->dir_z[lane] = (float)ray->direction[2];
    rays->tnear[lane] = (float)(ray->t_min * (1 - slack));
    rays->tfar[lane] = ray->t_max < (double)FLT_MAX ? (float)(ray->t_max * (1 + slack)) : FLT_MAX;
    rays->time[lane] = 0;
    rays->mask[lane] = UINT32_MAX;
    rays->id[lane] = (unsigned)lane;
    rays->flags[lane] = 0;
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
        packet->waiting_counts[i] = 0;
        fill_lane(rays, i, &packet->rays[valid[i] ? i : 0], slack);
    }
}

/* Adds what waits on a ray, but for what lies behind its end at t in f32. */
static void add_waiting(struct rt_packet *packet, int lane, float end)
{
    float beyond = end * (1 + 1e-3f);
    for (int i = 0; i < packet->waiting_counts[lane]; i++) {
        const struct rt_candidate *candidate = &packet->waiting[lane][i];
        if (candidate->t <= beyond)
            rt_scene_add_hit(packet->scene, &packet->rays[lane], candidate->mesh,
                             candidate->triangle, &packet->hits[lane]);
    }
}

static bool is_kept(const struct rt_hits *hits, uint32_t mesh, uint32_t triangle)
{
    for (size_t i = hits->count; i-- > 0;)
        if (hits->hits[i].mesh == mesh && hits->hits[i].triangle == triangle)
            return true;
    return false;
}

/* False where the ray's nearest opaque candidate does not end it, so that more may lie behind. */
static bool finish_ray(struct rt_packet *packet, int lane, const struct RTCRayHit8 *query)
{
    struct rt_hits *hits = &packet->hits[lane];
    uint32_t mesh = query->hit.geomID[lane], triangle = query->hit.primID[lane];
    bool is_ended = mesh == RTC_INVALID_GEOMETRY_ID || is_kept(hits, mesh, triangle) ||
                    rt_scene_add_hit(packet->scene, &packet->rays[lane], mesh, triangle, hits);
    if (!is_ended)
        return false;
    add_waiting(packet, lane, query->ray.tfar[lane]);
    rt_scene_order_hits(packet->scene, hits);
    return true;
}

static void prefetch(const struct rt_packet *packet, const struct RTCRayHit8 *query)
{
    for (int step = 0; step < 2; step++) {
        for (int i = 0; i < packet->count; i++) {
            if (query->hit.geomID[i] != RTC_INVALID_GEOMETRY_ID)
                rt_scene_prefetch(packet->scene, query->hit.geomID[i], query->hit.primID[i], step);
            for (int k = 0; step == 1 && k < packet->waiting_counts[i]; k++)
                rt_scene_prefetch(packet->scene, packet->waiting[i][k].mesh,
                                  packet->waiting[i][k].triangle, step);
        }
    }
}

static void intersect(struct rt_packet *packet, struct RTCRayHit8 *query, bool is_filtering_all)
{
    struct packet_context context = {.packet = packet};
    _Alignas(32) int valid[RT_LANES];
    begin(packet, &query->ray, valid, 1e-4);
    rtcInitIntersectContext(&context.embree);
    context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    if (is_filtering_all)
        context.embree.filter = filter_lanes;
    for (int i = 0; i < RT_LANES; i++) {
        query->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        if (is_filtering_all)
            query->ray.tnear[i] = 0;
    }
    if (packet->scene->has_packets)
        rtcIntersect8(valid, packet->scene->scene, &context.embree, query);
    for (int i = 0; !packet->scene->has_packets && i < packet->count; i++) {
        struct RTCRayHit one = {.ray = lane_ray(&query->ray, i),
                                .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
        rtcIntersect1(packet->scene->scene, &context.embree, &one);
        query->ray.tfar[i] = one.ray.tfar;
        query->hit.geomID[i] = one.hit.geomID;
        query->hit.primID[i] = one.hit.primID;
    }
    prefetch(packet, query);
}

/* Opaque surfaces that are seen from one side end rays here from both: few rays meet them from
 * behind. Where one does, it is traced again and neighbouring packets look at each hit. */
void rt_packet_collect(struct rt_packet *packet)
{
    enum { WARY_PACKETS = 16 };
    _Alignas(32) struct RTCRayHit8 query;
    bool is_filtering_all = filters_all(packet), has_passed = false;
    intersect(packet, &query, is_filtering_all);
    packet->wary -= packet->wary > 0;
    for (int i = 0; i < packet->count; i++) {
        if (finish_ray(packet, i, &query))
            continue;
        has_passed = true;
        rt_scene_collect(packet->scene, &packet->rays[i], &packet->hits[i]);
    }
    if (has_passed && !is_filtering_all)
        packet->wary = WARY_PACKETS;
}

void rt_packet_occlude(struct rt_packet *packet)
{
    struct packet_context context = {.packet = packet};
    _Alignas(32) struct RTCRay8 rays;
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
        if (packet->is_occluded[i])
            continue;
        add_waiting(packet, i, INFINITY);
        rt_scene_order_hits(packet->scene, &packet->hits[i]);
    }
}

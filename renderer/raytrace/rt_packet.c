/* SPDX-License-Identifier: MIT */
/* Packets of rays, and the filter that keeps what they cross. */
#include "renderer/raytrace/rt_packet.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/processor_forms.h"

struct packet_context { /* Embree hands its first member to filters */
    struct embree_context embree;
    struct rt_packet *packet;
    uint32_t first; /* lane of the packet that Embree calls ray 0 */
};

/* Rays of one call of Embree's, 16 or 8. What all calls have alike is set once. */
struct rt_query {
    union {
        struct RTCRayHit16 sixteen;
        struct RTCRayHit8 eight;
        float floats[(RT_RAY_MEMBERS + RT_HIT_MEMBERS) * 16];
        uint32_t words[(RT_RAY_MEMBERS + RT_HIT_MEMBERS) * 16];
    };
    _Alignas(64) int valid[RT_LANES];
    unsigned width;
};

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

/* The hit's first members are the normal of the triangle, in an instance's own coordinates. */
static void find_candidate_normal(const struct RTCFilterFunctionNArguments *args, unsigned i,
                                  const struct rt_mesh *mesh, double normal[3])
{
    double given[3];
    for (unsigned k = 0; k < 3; k++)
        given[k] = (double)packet_float(args->hit, args->N, k, i);
    for (int k = 0; k < 3; k++)
        normal[k] = mesh->positions ? (mesh->is_mirrored ? -given[k] : given[k])
                                    : vec3_dot(mesh->normal_matrix[k], given);
}

/* Whether a camera ray certainly ends at this opaque candidate, as most do: a face that looks its
 * way, beyond the near plane. Only the last of these is recomputed, when the packet is through. */
static bool is_plain_end(const struct rt_packet *packet,
                         const struct RTCFilterFunctionNArguments *args, unsigned i,
                         const struct rt_ray *ray, const struct rt_mesh *mesh)
{
    if (!ray->culls_back_faces || packet->scene->clip_plane_count)
        return false;
    double t = (double)packet_float(args->ray, args->N, RT_RAY_TFAR, i);
    if (t < ray->t_min * 1.0001 || t * 1.0001 > ray->t_max)
        return false;
    double normal[3], along = 0, square = 0;
    find_candidate_normal(args, i, mesh, normal);
    for (unsigned k = 0; k < 3; k++) {
        double n = normal[k], d = ray->direction[k];
        along += n * d;
        square += n * n * d * d;
    }
    return along < 0 && along * along > 1e-8 * square;
}

static uint32_t meets_lane(const struct RTCFilterFunctionNArguments *args, unsigned i)
{
    const float u = packet_float(args->hit, args->N, RT_HIT_U, i);
    const float v = packet_float(args->hit, args->N, RT_HIT_U + 1, i);
    float along = 0, normal = 0, way = 0;
    for (unsigned k = 0; k < 3; k++) {
        const float n = packet_float(args->hit, args->N, k, i);
        const float d = packet_float(args->ray, args->N, RT_RAY_DIRECTION + k, i);
        along += n * d;
        normal += n * n;
        way += d * d;
    }
    return rt_meets(along, normal * way) | rt_meets_inside(u, v);
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
    uint32_t first = ((const struct packet_context *)embree_context_of(args))->first;
    uint32_t lane = first + packet_word(args->ray, args->N, RT_RAY_ID, i);
    struct rt_candidate candidate = {
        packet_float(args->ray, args->N, RT_RAY_TFAR, i),
        rt_mesh_of_hit(packet_word(args->hit, args->N, RT_HIT_MESH, i),
                       packet_word(args->hit, args->N, RT_HIT_INSTANCE, i)),
        packet_word(args->hit, args->N, RT_HIT_TRIANGLE, i), 0};
    const struct rt_mesh *mesh = &packet->scene->meshes[candidate.mesh];
    if (mesh->is_sheet)
        candidate.meets = rt_mesh_meets(mesh, meets_lane(args, i));
    packet->used |= 1u << lane;
    packet->single |= 1u << lane;
    if (mesh->class_ == STATE_TRANSPARENT && put_aside(packet, lane, &candidate))
        return false;
    if (mesh->class_ == STATE_OPAQUE &&
        is_plain_end(packet, args, i, rt_packet_ray(packet, (int)lane), mesh))
        return true;
    return rt_scene_add_hit(packet->scene, rt_packet_ray(packet, (int)lane), candidate.mesh,
                            candidate.triangle, &packet->hits[lane]);
}

/* 1 << lane of those that a call is about, mostly few: found without a branch for each. */
static uint32_t valid_lanes(const int *valid, unsigned n)
{
    static const uint32_t bits[RT_LANES] = {
        1u << 0, 1u << 1, 1u << 2,  1u << 3,  1u << 4,  1u << 5,  1u << 6,  1u << 7,
        1u << 8, 1u << 9, 1u << 10, 1u << 11, 1u << 12, 1u << 13, 1u << 14, 1u << 15};
    uint32_t lanes = 0;
    if (n == RT_LANES) /* a constant is worth it */
        for (unsigned i = 0; i < RT_LANES; i++)
            lanes |= (uint32_t)valid[i] & bits[i];
    else
        for (unsigned i = 0; i < n; i++)
            lanes |= (uint32_t)valid[i] & bits[i];
    return lanes;
}

/* Lanes are known by their ray id, because Embree also filters parts of a packet. */
static void filter_lanes(const struct RTCFilterFunctionNArguments *args)
{
    const struct packet_context *context = (struct packet_context *)embree_context_of(args);
    struct rt_packet *packet = context->packet;
    uint32_t lanes = valid_lanes(args->valid, args->N);
    if (lanes && rt_crossings_keep(packet->crossings, packet->scene, args, lanes, context->first)) {
        packet->used |= lanes << context->first;
        for (unsigned i = 0; i < args->N; i++)
            args->valid[i] = 0;
        return;
    }
    for (; lanes; lanes &= lanes - 1) {
        unsigned i = (unsigned)__builtin_ctz(lanes);
        args->valid[i] = filter_lane(packet, args, i) ? -1 : 0;
    }
}

/* A filter of the context sees all hits; that of the geometry then leaves them to it. */
void rt_packet_filter(const struct RTCFilterFunctionNArguments *args)
{
    if (!embree_context_of(args)->filter)
        filter_lanes(args);
}

bool rt_packet_init(struct rt_packet *packet, const struct rt_scene *scene, struct error *err)
{
    size_t per_lane = RT_HITS_MAX + 64 / sizeof(struct rt_hit) + 1; /* the lanes' first hits lie in
                                                                        different cache lines of a
                                                                       page */
    struct rt_hit *hits = aligned_alloc(64, RT_LANES * per_lane * sizeof *hits);
    packet->query = aligned_alloc(64, sizeof *packet->query);
    packet->crossings = aligned_alloc(64, sizeof *packet->crossings);
    packet->hits[0].hits = hits;
    if (!hits || !packet->query || !packet->crossings)
        return error_set(err, ERROR_NO_MEMORY, "hits of a packet of rays");
    packet->scene = scene;
    for (size_t i = 0; i < RT_LANES; i++)
        packet->hits[i].hits = hits + i * per_lane;
    memset(packet->query, 0, sizeof *packet->query);
    memset(packet->crossings, 0, sizeof *packet->crossings);
    packet->query->width = scene->lanes == 8 ? 8 : RT_LANES;
    for (unsigned i = 0; i < packet->query->width; i++) {
        packet->query->words[RT_RAY_MASK * packet->query->width + i] = UINT32_MAX;
        packet->query->words[RT_RAY_ID * packet->query->width + i] = i;
    }
    return true;
}

void rt_packet_finish(struct rt_packet *packet)
{
    free(packet->hits[0].hits);
    free(packet->query);
    free(packet->crossings);
    packet->query = NULL;
    packet->crossings = NULL;
    memset(packet->hits, 0, sizeof packet->hits);
}

/* slack: how far beyond both ends hits are wanted, because f64 decides about them, over t. */
static inline void fill_lane(float *rays, unsigned width, unsigned lane, const struct rt_ray *ray,
                             double slack)
{
    float *at = rays + lane;
    for (unsigned k = 0; k < 3; k++) {
        at[(RT_RAY_ORIGIN + k) * width] = (float)ray->origin[k];
        at[(RT_RAY_DIRECTION + k) * width] = (float)ray->direction[k];
    }
    at[RT_RAY_TNEAR * width] = (float)(ray->t_min * (1 - slack));
    at[RT_RAY_TFAR * width] =
        ray->t_max < (double)FLT_MAX ? (float)(ray->t_max * (1 + slack)) : FLT_MAX;
}

/* Embree 3.13 as GCC 12 compiles it for AVX-512 never leaves its way for coherent rays to
 * instances: of the mask of rays that are left it writes 16 bits and reads 64
 * (docs/explanation/ray-tracing.md, "Meshes that nodes share"). */
static bool may_be_coherent(const struct rt_scene *scene)
{
    return scene->shapes.count == 0;
}

/* Rays of the packet from `first` on, as many as fit. */
static void fill(const struct rt_packet *packet, unsigned first, double slack)
{
    struct rt_query *query = packet->query;
    unsigned count = (unsigned)packet->count - first;
    count = count < query->width ? count : query->width;
    if (query->width == RT_LANES) /* a constant is worth it */
        for (unsigned i = 0; i < count; i++)
            fill_lane(query->floats, RT_LANES, i, &packet->rays[first + i], slack);
    else
        for (unsigned i = 0; i < count; i++)
            fill_lane(query->floats, query->width, i, &packet->rays[first + i], slack);
    for (unsigned i = 0; i < query->width; i++)
        query->valid[i] = i < count ? -1 : 0;
}

INSIDE_FORMS void narrow_lanes(const struct rt_wide_rays *rays, unsigned first, unsigned width,
                               double slack, float *floats)
{
    const double sooner = 1 - slack, later = 1 + slack;
    for (unsigned k = 0; k < 3; k++) {
        for (unsigned i = 0; i < width; i++)
            floats[(RT_RAY_ORIGIN + k) * width + i] = (float)rays->origin[k][first + i];
        for (unsigned i = 0; i < width; i++)
            floats[(RT_RAY_DIRECTION + k) * width + i] = (float)rays->direction[k][first + i];
    }
    for (unsigned i = 0; i < width; i++) {
        double t_max = rays->t_max[first + i];
        float end = (float)(t_max * later);
        floats[RT_RAY_TNEAR * width + i] = (float)(rays->t_min[first + i] * sooner);
        floats[RT_RAY_TFAR * width + i] = t_max < (double)FLT_MAX ? end : FLT_MAX;
    }
}

PROCESSOR_FORMS static void narrow_rays(const struct rt_wide_rays *restrict rays, unsigned first,
                                        unsigned width, double slack, float *restrict floats)
{
    if (width == RT_LANES) /* constants are worth it */
        narrow_lanes(rays, first, RT_LANES, slack, floats);
    else
        narrow_lanes(rays, first, 8, slack, floats);
}

/* The same of rays that lie side by side. lanes: those to trace. */
static void fill_wide(const struct rt_packet *packet, const struct rt_wide_rays *rays,
                      unsigned first, uint32_t lanes, double slack)
{
    struct rt_query *query = packet->query;
    narrow_rays(rays, first, query->width, slack, query->floats);
    for (unsigned i = 0; i < RT_LANES; i++)
        query->valid[i] = lanes >> first >> i & 1 ? -1 : 0;
}

static struct RTCRay lane_ray(const struct rt_query *query, unsigned lane)
{
    const float *at = query->floats + lane;
    const unsigned w = query->width;
    return (struct RTCRay){.org_x = at[RT_RAY_ORIGIN * w],
                           .org_y = at[(RT_RAY_ORIGIN + 1) * w],
                           .org_z = at[(RT_RAY_ORIGIN + 2) * w],
                           .dir_x = at[RT_RAY_DIRECTION * w],
                           .dir_y = at[(RT_RAY_DIRECTION + 1) * w],
                           .dir_z = at[(RT_RAY_DIRECTION + 2) * w],
                           .tnear = at[RT_RAY_TNEAR * w],
                           .tfar = at[RT_RAY_TFAR * w],
                           .mask = UINT32_MAX,
                           .id = lane};
}

enum { WARY_RAYS = 128 };

static void forget_hits(struct rt_packet *packet)
{
    for (uint32_t lanes = packet->used; lanes; lanes &= lanes - 1) {
        int i = __builtin_ctz(lanes);
        packet->hits[i].count = 0;
        packet->hits[i].has_overflowed = false;
        packet->waiting_counts[i] = 0;
    }
    packet->used = packet->ended = packet->single = 0;
    packet->crossings->count = 0;
}

/* Adds what waits on a ray, but for what lies behind its end at t in f32. */
static void add_waiting(struct rt_packet *packet, int lane, float end)
{
    float beyond = end * (1 + 1e-3f);
    for (int i = 0; i < packet->waiting_counts[lane]; i++) {
        const struct rt_candidate *candidate = &packet->waiting[lane][i];
        if (candidate->t <= beyond)
            rt_scene_add_hit(packet->scene, rt_packet_ray(packet, lane), candidate->mesh,
                             candidate->triangle, &packet->hits[lane]);
    }
}

void rt_packet_spread(struct rt_packet *packet, uint32_t lanes)
{
    const struct rt_crossing *crossing = packet->crossings->crossings;
    for (int c = 0; c < packet->crossings->count; c++, crossing++)
        for (uint32_t left = lanes & packet->used; left; left &= left - 1) {
            const int i = __builtin_ctz(left);
            const struct rt_candidate candidate = {crossing->t[i], crossing->mesh,
                                                   crossing->triangle, crossing->meets[i]};
            if (candidate.t < INFINITY && !put_aside(packet, (uint32_t)i, &candidate))
                rt_scene_add_hit(packet->scene, rt_packet_ray(packet, i), crossing->mesh,
                                 crossing->triangle, &packet->hits[i]);
        }
    packet->crossings->count = 0;
}

static bool is_kept(const struct rt_hits *hits, uint32_t mesh, uint32_t triangle)
{
    for (size_t i = hits->count; i-- > 0;)
        if (hits->hits[i].mesh == mesh && hits->hits[i].triangle == triangle)
            return true;
    return false;
}

/* False where the ray's nearest opaque candidate does not end it, so that more may lie behind. */
static bool finish_ray(struct rt_packet *packet, int lane)
{
    struct rt_hits *hits = &packet->hits[lane];
    const struct rt_candidate *end = &packet->ends[lane];
    packet->used |= 1u << lane;
    bool is_ended = end->mesh == RTC_INVALID_GEOMETRY_ID ||
                    is_kept(hits, end->mesh, end->triangle) ||
                    rt_scene_add_hit(packet->scene, rt_packet_ray(packet, lane), end->mesh,
                                     end->triangle, hits);
    if (!is_ended)
        return false;
    add_waiting(packet, lane, end->t);
    rt_scene_order_hits(packet->scene, hits);
    return true;
}

/* Neighbours mostly end on one triangle. */
static void prefetch(const struct rt_packet *packet)
{
    for (int step = 0; step < 2; step++) {
        uint32_t mesh = RTC_INVALID_GEOMETRY_ID, triangle = 0;
        for (uint32_t lanes = packet->used | packet->ended; lanes; lanes &= lanes - 1) {
            int i = __builtin_ctz(lanes);
            const struct rt_candidate *end = &packet->ends[i];
            if ((packet->ended >> i & 1) && (end->mesh != mesh || end->triangle != triangle)) {
                mesh = end->mesh;
                triangle = end->triangle;
                rt_scene_prefetch(packet->scene, mesh, triangle, step);
            }
            for (int k = 0; step == 1 && k < packet->waiting_counts[i]; k++)
                rt_scene_prefetch(packet->scene, packet->waiting[i][k].mesh,
                                  packet->waiting[i][k].triangle, step);
        }
    }
}

/* meets: of width rays, whose hits are there. */
INSIDE_FORMS void find_meets(const float *floats, unsigned width, uint32_t *found)
{
    const float *normals = floats + RT_RAY_MEMBERS * width;
    const float *ways = floats + RT_RAY_DIRECTION * width;
    for (unsigned i = 0; i < width; i++) {
        float along = 0, normal = 0, way = 0;
        for (unsigned k = 0; k < 3; k++) {
            const float n = normals[k * width + i], d = ways[k * width + i];
            along += n * d;
            normal += n * n;
            way += d * d;
        }
        found[i] = rt_meets(along, normal * way);
    }
}

PROCESSOR_FORMS static void meet_ends(const float *restrict floats, unsigned width,
                                      uint32_t *restrict found)
{
    if (width == RT_LANES) /* constants are worth it */
        find_meets(floats, RT_LANES, found);
    else
        find_meets(floats, 8, found);
}

static void intersect_lanes(struct rt_packet *packet, struct packet_context *context,
                            unsigned count)
{
    struct rt_query *query = packet->query;
    const unsigned w = query->width;
    uint32_t *meshes = query->words + (RT_RAY_MEMBERS + RT_HIT_MESH) * w;
    uint32_t *instances = query->words + (RT_RAY_MEMBERS + RT_HIT_INSTANCE) * w;
    uint32_t *triangles = query->words + (RT_RAY_MEMBERS + RT_HIT_TRIANGLE) * w;
    float *ends = query->floats + RT_RAY_TFAR * w;
    for (unsigned i = 0; i < w; i++)
        meshes[i] = instances[i] = RTC_INVALID_GEOMETRY_ID;
    if (packet->scene->lanes == 16)
        embree_intersect16(query->valid, packet->scene->scene, &context->embree, &query->sixteen);
    else if (packet->scene->lanes == 8)
        embree_intersect8(query->valid, packet->scene->scene, &context->embree, &query->eight);
    for (unsigned i = 0; packet->scene->lanes == 1 && i < count; i++) {
        struct RTCRayHit one = {
            .ray = lane_ray(query, i),
            .hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .instID = {RTC_INVALID_GEOMETRY_ID}}};
        embree_intersect1(packet->scene->scene, &context->embree, &one);
        ends[i] = one.ray.tfar;
        meshes[i] = one.hit.geomID;
        instances[i] = one.hit.instID[0];
        triangles[i] = one.hit.primID;
    }
    uint32_t ended = 0, found[RT_LANES];
    meet_ends(query->floats, w, found);
    for (unsigned i = 0; i < count; i++) {
        packet->ends[context->first + i] =
            (struct rt_candidate){.t = ends[i],
                                  .mesh = rt_mesh_of_hit(meshes[i], instances[i]),
                                  .triangle = triangles[i],
                                  .meets = found[i]};
        ended |= (uint32_t)(meshes[i] != RTC_INVALID_GEOMETRY_ID) << i;
    }
    packet->ended |= ended << context->first;
}

/* rays: side by side, or NULL: those of the packet. */
static void intersect(struct rt_packet *packet, const struct rt_wide_rays *rays,
                      bool is_filtering_all)
{
    struct packet_context context = {.packet = packet};
    const unsigned width = packet->query->width, count = (unsigned)packet->count;
    embree_context_init(&context.embree);
    context.embree.is_coherent = may_be_coherent(packet->scene);
    if (is_filtering_all)
        context.embree.filter = filter_lanes;
    forget_hits(packet);
    for (; context.first < count; context.first += width) {
        if (rays)
            fill_wide(packet, rays, context.first, (1u << count) - 1, 1e-4);
        else
            fill(packet, context.first, 1e-4);
        for (unsigned i = 0; is_filtering_all && i < width; i++)
            packet->query->floats[RT_RAY_TNEAR * width + i] = 0;
        unsigned rest = count - context.first;
        intersect_lanes(packet, &context, rest < width ? rest : width);
    }
    prefetch(packet);
}

/* Opaque surfaces that are seen from one side end rays here from both: few rays meet them from
 * behind. Where one does, it is traced again and neighbouring packets look at each hit. */
void rt_packet_collect(struct rt_packet *packet)
{
    bool is_filtering_all = filters_all(packet), has_passed = false;
    packet->made = UINT32_MAX;
    intersect(packet, NULL, is_filtering_all);
    rt_packet_spread(packet, UINT32_MAX);
    packet->wary -= packet->wary < packet->count ? packet->wary : packet->count;
    for (int i = 0; i < packet->count; i++) {
        if (finish_ray(packet, i))
            continue;
        has_passed = true;
        rt_scene_collect(packet->scene, &packet->rays[i], &packet->hits[i]);
    }
    if (has_passed && !is_filtering_all)
        packet->wary = WARY_RAYS;
}

bool rt_packet_is_wary(const struct rt_packet *packet)
{
    return filters_all(packet);
}

void rt_packet_seek(struct rt_packet *packet, const struct rt_wide_rays *rays)
{
    packet->made = 0;
    intersect(packet, rays, false);
}

void rt_packet_collect_one(struct rt_packet *packet, int lane)
{
    const struct rt_ray *ray = rt_packet_ray(packet, lane);
    if (finish_ray(packet, lane))
        return;
    rt_scene_collect(packet->scene, ray, &packet->hits[lane]);
    packet->wary = WARY_RAYS;
}

static void occlude_lanes(struct rt_packet *packet, struct packet_context *context, unsigned count)
{
    struct rt_query *query = packet->query;
    float *ends = query->floats + RT_RAY_TFAR * query->width;
    if (packet->scene->lanes == 16)
        embree_occluded16(query->valid, packet->scene->scene, &context->embree,
                          &query->sixteen.ray);
    else if (packet->scene->lanes == 8)
        embree_occluded8(query->valid, packet->scene->scene, &context->embree, &query->eight.ray);
    for (unsigned i = 0; packet->scene->lanes == 1 && i < count; i++) {
        if (!query->valid[i])
            continue;
        struct RTCRay one = lane_ray(query, i);
        embree_occluded1(packet->scene->scene, &context->embree, &one);
        ends[i] = one.tfar;
    }
    for (unsigned i = 0; i < count; i++)
        packet->is_occluded[context->first + i] = ends[i] < 0; /* -inf, says Embree */
}

/* rays, lanes: side by side; NULL: those of the packet, all of them. */
static void occlude(struct rt_packet *packet, const struct rt_wide_rays *rays, uint32_t lanes)
{
    struct packet_context context = {.packet = packet};
    const unsigned width = packet->query->width, count = (unsigned)packet->count;
    embree_context_init(&context.embree);
    context.embree.is_coherent = may_be_coherent(packet->scene);
    if (packet->scene->clip_plane_count)
        context.embree.filter = filter_lanes;
    forget_hits(packet);
    for (; context.first < count; context.first += width) {
        unsigned rest = count - context.first;
        if (rays && !(lanes >> context.first & ((1u << width) - 1)))
            continue;
        if (rays)
            fill_wide(packet, rays, context.first, lanes, 0);
        else
            fill(packet, context.first, 0);
        occlude_lanes(packet, &context, rest < width ? rest : width);
    }
}

static void collect_filters(struct rt_packet *packet, int lane)
{
    add_waiting(packet, lane, INFINITY);
    rt_scene_order_hits(packet->scene, &packet->hits[lane]);
}

void rt_packet_occlude(struct rt_packet *packet)
{
    uint32_t lanes = 0;
    packet->made = UINT32_MAX;
    occlude(packet, NULL, 0);
    for (int i = 0; i < packet->count; i++)
        lanes |= (uint32_t)!packet->is_occluded[i] << i;
    rt_packet_spread(packet, lanes);
    for (; lanes; lanes &= lanes - 1)
        collect_filters(packet, __builtin_ctz(lanes));
}

static bool is_among(const struct rt_candidate *known, int count,
                     const struct rt_candidate *candidate)
{
    for (int k = 0; k < count; k++)
        if (rt_candidate_is_same(&known[k], candidate))
            return true;
    return false;
}

static bool is_sheet_clear(const struct rt_candidate *candidate)
{
    return (candidate->meets & RT_MEETS_CLEARLY) == RT_MEETS_CLEARLY;
}

/* Puts what waits on a ray in order, each triangle once. Returns how many lie before t_max; -1
 * where f32 does not tell: something is not clear, or near an end of the ray or to another. */
static int order_sheets(struct rt_packet *packet, int lane, double t_min, double t_max)
{
    struct rt_candidate *waiting = packet->waiting[lane];
    const double apart = rt_crossing_apart_m(packet->scene);
    double before = t_min;
    int count = 0, kept = 0;
    if (packet->hits[lane].count || packet->hits[lane].has_overflowed)
        return -1;
    for (int i = 0; i < packet->waiting_counts[lane]; i++) {
        const struct rt_candidate candidate = waiting[i];
        if (!is_sheet_clear(&candidate))
            return -1;
        if (is_among(waiting, count, &candidate))
            continue;
        int k = count++;
        for (; k && waiting[k - 1].t > candidate.t; k--)
            waiting[k] = waiting[k - 1];
        waiting[k] = candidate;
    }
    for (; kept < count && (double)waiting[kept].t < t_max; kept++) {
        const double t = (double)waiting[kept].t;
        if (!(t - before > apart + 1e-5 * before))
            return -1;
        before = t;
    }
    const double beyond = kept < count ? (double)waiting[kept].t - t_max : INFINITY;
    const double slack = apart + 1e-5 * before;
    return t_max - before > slack && beyond > apart + 1e-5 * t_max ? kept : -1;
}

int rt_packet_sheets(struct rt_packet *packet, const struct rt_wide_rays *rays, int lane)
{
    const struct rt_candidate *end = &packet->ends[lane];
    const double t_min = rays->t_min[lane], t_max = rays->t_max[lane], t = (double)end->t;
    if (!(packet->ended >> lane & 1))
        return order_sheets(packet, lane, t_min, t_max);
    const struct rt_mesh *mesh = &packet->scene->meshes[end->mesh];
    const uint32_t found = rt_packet_end_meets(packet, lane);
    const bool is_drawn = mesh->is_double_sided || (found & RT_MEETS_FRONT);
    if (!is_drawn || !(found & RT_MEETS_LEANING) || !(t > t_min * 1.0001 && t * 1.0001 < t_max))
        return -1;
    if (!packet->waiting_counts[lane])
        return packet->hits[lane].count || packet->hits[lane].has_overflowed ? -1 : 0;
    return found & RT_MEETS_STEEP ? order_sheets(packet, lane, t_min, t) : -1;
}

bool rt_packet_end_is_front(const struct rt_packet *packet, int lane)
{
    return rt_packet_end_meets(packet, lane) & RT_MEETS_FRONT;
}

/* False where hits are needed. */
static bool pass_sheets(struct rt_packet *packet, const struct rt_wide_rays *rays, int lane,
                        double (*passes)[RT_WIDE])
{
    int count = order_sheets(packet, lane, rays->t_min[lane], rays->t_max[lane]);
    if (count < 0)
        return false;
    for (int i = 0; i < count; i++) {
        const double *filter = packet->scene->meshes[packet->waiting[lane][i].mesh].filter;
        for (int k = 0; k < 3; k++)
            passes[k][lane] *= filter[k];
    }
    packet->waiting_counts[lane] = 0;
    packet->used &= ~(1u << lane);
    return true;
}

/* The filters of one crossing. */
PROCESSOR_FORMS static void filter_all(const struct rt_crossing *restrict crossing,
                                       const double filter[3], double (*restrict passes)[RT_WIDE])
{
    const double own[3] = {filter[0], filter[1], filter[2]};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < RT_WIDE; i++) {
            const double passed = passes[k][i] * own[k];
            passes[k][i] = crossing->is_before[i] ? passed : passes[k][i];
        }
}

/* All that a packet crosses, as pass_sheets has it for one ray. Returns 1 << lane of those that are
 * not among it, where hits may be needed. */
static uint32_t pass_crossings(struct rt_packet *packet, const struct rt_wide_rays *rays,
                               uint32_t lanes, double (*passes)[RT_WIDE])
{
    struct rt_crossings *crossings = packet->crossings;
    uint32_t clear =
        lanes & ~packet->single &
        rt_crossings_order(crossings, rt_crossing_apart_m(packet->scene), rays->t_min, rays->t_max);
    for (int c = 0; c < crossings->count; c++) {
        struct rt_crossing *crossing = &crossings->crossings[crossings->order[c]];
        for (int i = 0; i < RT_LANES; i++)
            crossing->is_before[i] &= clear >> i;
        filter_all(crossing, packet->scene->meshes[crossing->mesh].filter, passes);
    }
    packet->used &= ~clear;
    return lanes & ~clear;
}

uint32_t rt_packet_pass(struct rt_packet *packet, const struct rt_wide_rays *rays, uint32_t lanes,
                        double (*passes)[RT_WIDE])
{
    packet->made = 0;
    occlude(packet, rays, lanes);
    for (int i = 0; i < packet->count; i++)
        lanes &= ~((uint32_t)packet->is_occluded[i] << i);
    uint32_t asked = lanes & packet->used;
    if (passes && asked && packet->crossings->count)
        asked = pass_crossings(packet, rays, asked, passes);
    rt_packet_spread(packet, asked);
    for (uint32_t left = asked; left; left &= left - 1) {
        const int i = __builtin_ctz(left);
        if (!passes || !pass_sheets(packet, rays, i, passes))
            collect_filters(packet, i);
    }
    return lanes;
}

/* SPDX-License-Identifier: MIT */
/* Keeping crossings, and putting them in order, sixteen rays at a time. */
#include "renderer/raytrace/rt_crossing.h"

#include <math.h>

enum { LEAST_LANES = 4 }; /* that are worth a crossing */

/* Arrays of a filter's rays and hits, by their members. */
struct shown {
    const float *rays, *hits;
    const uint32_t *ray_words, *hit_words;
    const int *valid;
};

/* Whether all rays are shown one triangle, and stand where the packet has them. */
INSIDE_FORMS bool are_one(const struct shown *shown, unsigned n, uint32_t mesh, uint32_t triangle)
{
    const uint32_t *ids = shown->ray_words + RT_RAY_ID * n;
    const uint32_t *meshes = shown->hit_words + RT_HIT_MESH * n;
    const uint32_t *instances = shown->hit_words + RT_HIT_INSTANCE * n;
    const uint32_t *triangles = shown->hit_words + RT_HIT_TRIANGLE * n;
    uint32_t differs = 0;
    for (unsigned i = 0; i < n; i++)
        differs |= (uint32_t)shown->valid[i] &
                   ((meshes[i] ^ mesh) | (triangles[i] ^ triangle) | ~instances[i] | (ids[i] ^ i));
    return !differs;
}

/* to: of the first of the n lanes. turn: what the mesh calls its front is another side. */
INSIDE_FORMS void note(const struct shown *shown, unsigned n, uint32_t turn, bool is_new,
                       unsigned first, struct rt_crossing *to)
{
    const float *ways = shown->rays + RT_RAY_DIRECTION * n;
    const float *ends = shown->rays + RT_RAY_TFAR * n, *places = shown->hits + RT_HIT_U * n;
    const uint32_t *bits = shown->ray_words + RT_RAY_TFAR * n;
    uint32_t least = is_new ? UINT32_MAX : to->least;
    for (unsigned i = 0; i < n; i++) {
        float along = 0, normal = 0, way = 0;
        for (unsigned k = 0; k < 3; k++) {
            const float a = shown->hits[k * n + i], d = ways[k * n + i];
            along += a * d;
            normal += a * a;
            way += d * d;
        }
        const uint32_t found =
            (rt_meets(along, normal * way) ^ turn) | rt_meets_inside(places[i], places[n + i]);
        const uint32_t bits_here = shown->valid[i] ? bits[i] : UINT32_MAX;
        to->t[first + i] = shown->valid[i] ? ends[i] : to->t[first + i];
        to->meets[first + i] = shown->valid[i] ? found : to->meets[first + i];
        least = bits_here < least ? bits_here : least; /* distances are not negative */
    }
    to->least = least;
}

PROCESSOR_FORMS static bool are_all_one(const struct shown *shown, unsigned n, uint32_t mesh,
                                        uint32_t triangle)
{
    const struct shown own = *shown;
    return n == RT_LANES ? are_one(&own, RT_LANES, mesh, triangle)
                         : are_one(&own, 8, mesh, triangle); /* constants are worth it */
}

PROCESSOR_FORMS static void note_all(const struct shown *restrict shown, unsigned n, uint32_t turn,
                                     bool is_new, unsigned first, struct rt_crossing *restrict to)
{
    const struct shown own = *shown;
    for (int i = 0; i < RT_LANES; i++)
        to->t[i] = is_new ? INFINITY : to->t[i];
    if (n == RT_LANES)
        note(&own, RT_LANES, turn, is_new, 0, to);
    else
        note(&own, 8, turn, is_new, first, to);
}

bool rt_crossings_keep(struct rt_crossings *crossings, const struct rt_scene *scene,
                       const struct RTCFilterFunctionNArguments *args, uint32_t lanes,
                       uint32_t first)
{
    const unsigned n = args->N, one = (unsigned)__builtin_ctz(lanes);
    const struct shown shown = {.rays = (const float *)args->ray,
                                .hits = (const float *)args->hit,
                                .ray_words = (const uint32_t *)args->ray,
                                .hit_words = (const uint32_t *)args->hit,
                                .valid = args->valid};
    if ((n != RT_LANES && n != 8) || __builtin_popcount(lanes) < LEAST_LANES)
        return false;
    const uint32_t mesh = shown.hit_words[RT_HIT_MESH * n + one];
    const uint32_t triangle = shown.hit_words[RT_HIT_TRIANGLE * n + one];
    if (!are_all_one(&shown, n, mesh, triangle))
        return false;
    const struct rt_mesh *m = &scene->meshes[mesh];
    if (!m->is_sheet || m->class_ != STATE_TRANSPARENT || !m->positions)
        return false;
    int at = crossings->count;
    while (at-- > 0)
        if (crossings->crossings[at].mesh == mesh && crossings->crossings[at].triangle == triangle)
            break;
    const bool is_new = at < 0;
    if (is_new && crossings->count == RT_CROSSINGS_MAX)
        return false;
    if (is_new)
        at = crossings->count++;
    struct rt_crossing *to = &crossings->crossings[at];
    to->mesh = mesh;
    to->triangle = triangle;
    note_all(&shown, n, m->is_mirrored ? RT_MEETS_FRONT : 0, is_new, first, to);
    return true;
}

/* Goes on to the next crossing of each ray. is_clear: whether all has been beyond doubt. */
INSIDE_FORMS void pass(struct rt_crossing *crossing, double apart, const double *t_max,
                       double *before, uint32_t *is_clear)
{
    for (int i = 0; i < RT_LANES; i++) {
        const double t = (double)crossing->t[i], end = t_max[i];
        const bool crosses = t < INFINITY, is_before = crosses & (t < end);
        const double from = is_before ? before[i] : end, gap = t - from;
        const bool is_met_clearly = (crossing->meets[i] & RT_MEETS_CLEARLY) == RT_MEETS_CLEARLY;
        is_clear[i] &= (crosses & is_met_clearly & (gap > apart + 1e-5 * from)) | (!crosses);
        crossing->is_before[i] = is_before;
        before[i] = is_before ? t : before[i];
    }
}

PROCESSOR_FORMS static void pass_all(struct rt_crossings *restrict crossings, double apart,
                                     const double *restrict t_min, const double *restrict t_max,
                                     uint32_t *restrict is_clear)
{
    double before[RT_LANES];
    for (int i = 0; i < RT_LANES; i++) {
        before[i] = t_min[i];
        is_clear[i] = 1;
    }
    for (int c = 0; c < crossings->count; c++)
        pass(&crossings->crossings[crossings->order[c]], apart, t_max, before, is_clear);
    for (int i = 0; i < RT_LANES; i++)
        is_clear[i] &= t_max[i] - before[i] > apart + 1e-5 * before[i];
}

uint32_t rt_crossings_order(struct rt_crossings *crossings, double apart_m,
                            const double t_min[RT_LANES], const double t_max[RT_LANES])
{
    int *order = crossings->order;
    uint32_t is_clear[RT_LANES], lanes = 0;
    for (int c = 0; c < crossings->count; c++) {
        int at = c;
        for (; at && crossings->crossings[order[at - 1]].least > crossings->crossings[c].least;
             at--)
            order[at] = order[at - 1];
        order[at] = c;
    }
    pass_all(crossings, apart_m, t_min, t_max, is_clear);
    for (int i = 0; i < RT_LANES; i++)
        lanes |= is_clear[i] << i;
    return lanes;
}

/* SPDX-License-Identifier: MIT */
/* From a packet's crossings to its pixels. */
#include "renderer/raytrace/rt_whole_packet.h"

#include <string.h>

#include "renderer/base/processor_forms.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_pixel.h"
#include "renderer/raytrace/rt_whole_light.h"
#include "renderer/raytrace/rt_wide_lists.h"

enum { LEAST_LANES = 8 }; /* that are worth surfaces of their own */

/* What ends the rays: one mesh, or nothing. */
struct ends {
    _Alignas(64) double t_max[RT_WIDE];
    uint32_t is_opaque[RT_WIDE];
    uint32_t opaque;         /* 1 << lane; likewise the next */
    uint32_t steep;          /* what crosses their rays may be put in order, if all else lets it */
    uint32_t lanes;          /* of those that may go this way */
    uint32_t mesh, triangle; /* of the first opaque one */
    bool is_one_triangle;
};

/* Of pixels, front to back. */
struct sums {
    _Alignas(64) double layers[3][RT_WIDE], through[3][RT_WIDE];
};

struct pixels {
    _Alignas(64) float color[RT_WIDE][4];
};

static void find_ends(const struct rt_batch *batch, const struct rt_packet *packet,
                      const struct rt_wide_rays *rays, struct ends *ends)
{
    const uint32_t all = (1u << packet->count) - 1, ended = packet->ended & all;
    const struct rt_mesh *meshes = batch->desc.scene->meshes;
    memcpy(ends->t_max, rays->t_max, sizeof ends->t_max);
    memset(ends->is_opaque, 0, sizeof ends->is_opaque);
    ends->opaque = 0;
    ends->steep = ends->lanes = ~ended & packet->used & ~packet->single & all;
    ends->is_one_triangle = true;
    if (!ended)
        return;
    const struct rt_candidate *first = &packet->ends[__builtin_ctz(ended)];
    const struct rt_mesh *mesh = &meshes[first->mesh];
    ends->mesh = first->mesh;
    ends->triangle = first->triangle;
    if (!rt_whole_may_end(mesh) || !mesh->positions)
        return;
    for (uint32_t left = ended & ~packet->single; left; left &= left - 1) {
        const int i = __builtin_ctz(left);
        const struct rt_candidate *end = &packet->ends[i];
        const double t = (double)end->t;
        const uint32_t meets = rt_packet_end_meets(packet, i);
        const bool is_drawn = mesh->is_double_sided || (meets & RT_MEETS_FRONT);
        if (end->mesh != ends->mesh || !is_drawn || !(meets & RT_MEETS_LEANING) ||
            !(t > rays->t_min[i] * 1.0001 && t * 1.0001 < rays->t_max[i]))
            continue;
        ends->t_max[i] = t;
        ends->is_opaque[i] = 1;
        ends->opaque |= 1u << i;
        ends->steep |= (uint32_t)((meets & RT_MEETS_STEEP) != 0) << i;
        ends->is_one_triangle &= end->triangle == ends->triangle;
    }
    ends->lanes |= ends->opaque;
}

/* Those of the rays whose crossings are layers in a known order. */
static uint32_t find_layers(const struct rt_batch *batch, struct rt_packet *packet,
                            const struct rt_wide_rays *rays, const struct ends *ends)
{
    struct rt_crossings *crossings = packet->crossings;
    if (!crossings->count)
        return ends->lanes & ends->opaque;
    uint32_t lanes =
        ends->lanes & (ends->steep | ~packet->used) &
        rt_crossings_order(crossings, rt_crossing_apart_m(packet->scene), rays->t_min, ends->t_max);
    for (int c = 0; c < crossings->count; c++) {
        const struct rt_crossing *crossing = &crossings->crossings[c];
        const struct rt_mesh *mesh = &batch->desc.scene->meshes[crossing->mesh];
        for (int i = 0; i < RT_WIDE; i++) {
            const bool is_drawn = mesh->is_double_sided || (crossing->meets[i] & RT_MEETS_FRONT);
            const bool may_be = !crossing->is_before[i] || (mesh->is_plain && is_drawn);
            lanes &= ~((uint32_t)!may_be << i);
        }
    }
    return lanes;
}

static void put_triangle(const struct rt_mesh *mesh, uint32_t triangle, int lane,
                         struct rt_wide *wide)
{
    const uint32_t *vertices = mesh->triangles + 3 * (size_t)triangle;
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < 3; k++) {
            wide->corners[c][k][lane] = mesh->positions[vertices[c]][k];
            wide->normals[c][k][lane] = mesh->normals[3 * (size_t)vertices[c] + k];
        }
}

/* In all lanes. */
PROCESSOR_FORMS static void put_one_triangle(const struct rt_mesh *mesh, uint32_t triangle,
                                             struct rt_wide *wide)
{
    const uint32_t vertices[3] = {mesh->triangles[3 * (size_t)triangle],
                                  mesh->triangles[3 * (size_t)triangle + 1],
                                  mesh->triangles[3 * (size_t)triangle + 2]};
    const double(*positions)[3] = (const double(*)[3])mesh->positions;
    const float *normals = mesh->normals;
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < 3; k++) {
            const double corner = positions[vertices[c]][k];
            const float normal = normals[3 * (size_t)vertices[c] + k];
            for (int i = 0; i < RT_WIDE; i++) {
                wide->corners[c][k][i] = corner;
                wide->normals[c][k][i] = normal;
            }
        }
}

static void light_crossing(struct rt_batch *batch, const struct rt_crossing *crossing,
                           uint32_t lanes)
{
    struct rt_whole_group *group = &batch->wholes->packed;
    group->alike = rt_whole_evaluate(batch, crossing->mesh, crossing->triangle);
    put_one_triangle(&batch->desc.scene->meshes[crossing->mesh], crossing->triangle, &group->wide);
    for (int i = 0; i < RT_WIDE; i++)
        group->triangles[i] = crossing->triangle;
    rt_whole_light(batch, group, lanes);
}

static void light_ends(struct rt_batch *batch, const struct rt_packet *packet,
                       const struct ends *ends, uint32_t lanes)
{
    struct rt_whole_group *group = &batch->wholes->packed;
    const struct rt_mesh *mesh = &batch->desc.scene->meshes[ends->mesh];
    group->alike = rt_whole_evaluate(batch, ends->mesh, ends->triangle);
    for (uint32_t left = lanes; left; left &= left - 1) {
        const int i = __builtin_ctz(left);
        group->triangles[i] = packet->ends[i].triangle;
        if (!ends->is_one_triangle)
            put_triangle(mesh, packet->ends[i].triangle, i, &group->wide);
    }
    if (ends->is_one_triangle)
        put_one_triangle(mesh, ends->triangle, &group->wide);
    rt_whole_light(batch, group, lanes);
}

/* As rt_pixel_add_layer. */
PROCESSOR_FORMS static void add_layer(const uint32_t is_seen[restrict RT_WIDE],
                                      const struct rt_shading *shading,
                                      double (*restrict radiance)[RT_WIDE],
                                      struct sums *restrict sums)
{
    const double alpha = shading->alpha, *filter = shading->filter;
    for (int k = 0; k < 3; k++) {
        const double own = filter[k];
        for (int i = 0; i < RT_WIDE; i++) {
            const double through = sums->through[k][i];
            const double layers = sums->layers[k][i] + through * alpha * radiance[k][i];
            sums->layers[k][i] = is_seen[i] ? layers : sums->layers[k][i];
            sums->through[k][i] = is_seen[i] ? through * own : through;
        }
    }
}

/* As rt_pixel_end_sample and rt_pixel_write of one sample. open: what is seen where is_opaque is
 * not. */
PROCESSOR_FORMS static void end_pixels(const uint32_t is_opaque[restrict RT_WIDE],
                                       double (*restrict radiance)[RT_WIDE], const double open[4],
                                       const struct sums *restrict sums,
                                       struct pixels *restrict pixels)
{
    for (int k = 0; k < 3; k++) {
        const double none = open[k];
        for (int i = 0; i < RT_WIDE; i++) {
            const double behind = is_opaque[i] ? radiance[k][i] : none;
            pixels->color[i][k] = (float)(0. + (sums->layers[k][i] + sums->through[k][i] * behind));
        }
    }
    const double alpha = open[3];
    for (int i = 0; i < RT_WIDE; i++) {
        const double behind = is_opaque[i] ? 1 : alpha;
        const double through = sums->through[0][i] + sums->through[1][i] + sums->through[2][i];
        pixels->color[i][3] = (float)(0. + (1 - (1 - behind) * through / 3));
    }
}

static void write(const struct rt_batch *batch, const struct ends *ends, const struct sums *sums,
                  const int (*places)[2], uint32_t lanes)
{
    struct pixels pixels;
    double open[4];
    rt_pixel_background(batch->desc.view, NULL, NULL, open);
    end_pixels(ends->is_opaque, batch->wholes->radiance, open, sums, &pixels);
    for (; lanes; lanes &= lanes - 1) {
        const int i = __builtin_ctz(lanes), x = places[i][0], y = places[i][1];
        if (rt_job_has_pixel(batch->desc.job, x, y))
            memcpy(rt_job_pixel(batch->desc.job, x, y), pixels.color[i], sizeof pixels.color[i]);
    }
}

static void begin(struct rt_batch *batch, const struct rt_wide_rays *rays, const int (*places)[2],
                  int count, struct sums *sums)
{
    struct rt_whole_group *group = &batch->wholes->packed;
    group->ways = &rays->direction;
    group->count = RT_WIDE;
    for (int i = 0; i < RT_WIDE; i++) {
        group->x[i] = places[i < count ? i : 0][0];
        group->y[i] = places[i < count ? i : 0][1];
        group->wide.count[i] = 1;
        group->sought[i] = 1;
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < RT_WIDE; i++) {
            sums->layers[k][i] = 0;
            sums->through[k][i] = 1;
        }
}

/* Of one sample: lights the packet's surfaces and writes its pixels. */
static void show(struct rt_batch *batch, const struct rt_packet *packet,
                 const struct rt_wide_rays *rays, const struct ends *ends, const int (*pixels)[2],
                 uint32_t lanes)
{
    const struct rt_crossings *crossings = packet->crossings;
    struct sums sums;
    begin(batch, rays, pixels, packet->count, &sums);
    for (int c = 0; c < crossings->count; c++) {
        const struct rt_crossing *crossing = &crossings->crossings[crossings->order[c]];
        const uint32_t seen = rt_wide_lanes(crossing->is_before) & lanes;
        if (!seen)
            continue;
        light_crossing(batch, crossing, seen);
        add_layer(crossing->is_before, &batch->wholes->packed.alike->shading,
                  batch->wholes->radiance, &sums);
    }
    if (ends->opaque & lanes)
        light_ends(batch, packet, ends, ends->opaque & lanes);
    write(batch, ends, &sums, pixels, lanes);
}

/* Whether all samples of a pixel see the same. lanes: of it; seen: of each crossing in order. */
static bool are_alike(const struct rt_packet *packet, const struct ends *ends,
                      const uint32_t seen[RT_CROSSINGS_MAX], uint32_t lanes)
{
    const uint32_t opaque = ends->opaque & lanes;
    const int first = __builtin_ctz(lanes);
    if (opaque && opaque != lanes)
        return false;
    for (uint32_t left = opaque; left && !ends->is_one_triangle; left &= left - 1)
        if (packet->ends[__builtin_ctz(left)].triangle != packet->ends[first].triangle)
            return false;
    for (int c = 0; c < packet->crossings->count; c++)
        if ((seen[c] & lanes) && (seen[c] & lanes) != lanes)
            return false;
    return true;
}

/* A pixel of several samples, which are alike. */
static bool add_pixel(struct rt_batch *batch, const struct rt_whole_sample *at,
                      const uint32_t seen[RT_CROSSINGS_MAX], bool is_open)
{
    struct rt_wholes *wholes = batch->wholes;
    const struct rt_packet *packet = at->packet;
    const struct rt_crossings *crossings = packet->crossings;
    const struct rt_candidate *end = &packet->ends[at->lane];
    if (wholes->layer_count + RT_CROSSINGS_MAX > RT_WHOLE_LAYERS)
        return false;
    struct rt_whole_pixel *pixel = &wholes->pixels[wholes->count++];
    pixel->x = at->x;
    pixel->y = at->y;
    pixel->first_layer = (uint32_t)wholes->layer_count;
    pixel->is_open = is_open;
    pixel->split = 0;
    for (int c = 0; c < crossings->count; c++) {
        const struct rt_crossing *crossing = &crossings->crossings[crossings->order[c]];
        const struct rt_candidate met = {.mesh = crossing->mesh, .triangle = crossing->triangle};
        if (!(seen[c] >> at->lane & 1))
            continue;
        struct rt_whole_layer *layer = &wholes->layers[wholes->layer_count++];
        rt_wholes_add(batch, at, &met, layer, layer->radiance);
    }
    pixel->layer_count = (uint32_t)wholes->layer_count - pixel->first_layer;
    if (is_open)
        return true;
    pixel->mesh = end->mesh;
    pixel->is_front = rt_packet_end_is_front(packet, at->lane);
    for (int s = 0; s < batch->desc.samples; s++)
        pixel->triangles[s] = end->triangle;
    rt_wholes_add(batch, at, end, NULL, pixel->radiance);
    return true;
}

/* Of several samples: pixels whose samples all see the same. */
static uint32_t add_pixels(struct rt_batch *batch, struct rt_packet *packet,
                           const struct rt_wide_rays *rays, const struct ends *ends,
                           const int (*pixels)[2], uint32_t lanes)
{
    const int samples = batch->desc.samples;
    const struct rt_crossings *crossings = packet->crossings;
    struct rt_whole_sample at = {.packet = packet, .rays = rays};
    uint32_t seen[RT_CROSSINGS_MAX], taken = 0;
    for (int c = 0; c < crossings->count; c++)
        seen[c] = rt_wide_lanes(crossings->crossings[crossings->order[c]].is_before);
    for (; at.lane < packet->count; at.lane += samples, pixels++) {
        const uint32_t all = ((1u << samples) - 1) << at.lane;
        at.x = pixels[0][0];
        at.y = pixels[0][1];
        if ((lanes & all) == all && are_alike(packet, ends, seen, all) &&
            add_pixel(batch, &at, seen, !(ends->opaque & all)))
            taken |= all;
    }
    return taken;
}

uint32_t rt_wholes_take_packet(struct rt_batch *batch, struct rt_packet *packet,
                               const struct rt_wide_rays *rays, const int (*pixels)[2])
{
    const int samples = batch->desc.samples;
    const int least = samples > 1 ? samples : LEAST_LANES;
    struct ends ends;
    if (samples == 1 && batch->desc.view->screen.has_backdrop)
        return 0;
    find_ends(batch, packet, rays, &ends);
    /* without sheets, pixels on many triangles are added up by rt_wholes_take just as soon */
    const bool is_worth_it = samples == 1 || packet->crossings->count || ends.is_one_triangle;
    if (!is_worth_it || __builtin_popcount(ends.lanes) < least)
        return 0;
    const uint32_t lanes = find_layers(batch, packet, rays, &ends);
    if (__builtin_popcount(lanes) < least)
        return 0;
    if (samples > 1)
        return add_pixels(batch, packet, rays, &ends, pixels, lanes);
    show(batch, packet, rays, &ends, pixels, lanes);
    return lanes;
}

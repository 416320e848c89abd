/* SPDX-License-Identifier: MIT */
/* Gathering pixels that one surface fills, and lighting them. */
#include "renderer/raytrace/rt_whole.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/raytrace/rt_batch.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_pixel.h"
#include "renderer/raytrace/rt_whole_light.h"

enum { LAYERS_MAX = 32 }; /* of a pixel, with what ends it */

static bool has_area_lights(const struct rt_batch *batch)
{
    const size_t count = batch->desc.scene->state->light_count;
    for (size_t i = 0; i < count; i++)
        if (batch->desc.light_set->records[i].is_area)
            return true;
    return false;
}

/* Samples of one pixel are of one packet and of one part, air and media change what they see, and
 * clip planes have each hit looked at. Area lights and maps send many rays from each surface. */
static bool are_possible(const struct rt_batch *batch)
{
    const struct rt_batch_desc *desc = &batch->desc;
    const bool has_one_part = desc->samples == 1 || desc->samples == 4 || desc->samples == 8;
    return has_one_part && !batch->has_air && !desc->scene->state->medium_count &&
           !desc->scene->clip_plane_count && !desc->camera->is_orthographic && !desc->environment &&
           !has_area_lights(batch);
}

static void begin_group(struct rt_wholes *wholes, int number)
{
    struct rt_whole_group *group = &wholes->groups[number];
    group->alike = &wholes->alikes[number];
    group->alike->mesh = UINT32_MAX;
    group->ways = (const double(*)[3][RT_WIDE])wholes->ways[number];
}

bool rt_wholes_create(struct rt_wholes **wholes, const struct rt_batch *batch, struct error *err)
{
    *wholes = NULL;
    if (!are_possible(batch))
        return true;
    struct rt_wholes *made = aligned_alloc(64, (sizeof *made + 63) / 64 * 64);
    if (!made)
        return error_set(err, ERROR_NO_MEMORY, "pixels of a tile");
    memset(made, 0, sizeof *made);
    for (int i = 0; i < RT_WHOLE_GROUPS; i++)
        begin_group(made, i);
    *wholes = made;
    return true;
}

void rt_wholes_destroy(struct rt_wholes *wholes)
{
    free(wholes);
}

uint32_t rt_wholes_meet(const struct rt_batch *batch, const struct rt_packet *packet,
                        const struct rt_wide_rays *rays, uint32_t lanes, struct rt_wide_hits *hits)
{
    const struct rt_mesh *meshes = batch->desc.scene->meshes;
    uint32_t left, met = 0;
    lanes &= rt_packet_plain_ends(packet);
    for (left = lanes; left; left &= left - 1) {
        int i = __builtin_ctz(left);
        const struct rt_mesh *mesh = &meshes[packet->ends[i].mesh];
        const double *corners[3];
        double room[3][3];
        if (!rt_whole_may_end(mesh)) {
            lanes &= ~(1u << i);
            continue;
        }
        rt_mesh_corners(mesh, packet->ends[i].triangle, room, corners);
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                hits->corners[c][k][i] = corners[c][k];
        hits->turn[i] = mesh->is_mirrored ? -1 : 1;
    }
    if (!lanes)
        return 0;
    rt_wide_meet(rays, hits, batch->desc.samples > 1);
    for (left = lanes; left; left &= left - 1) {
        int i = __builtin_ctz(left);
        bool is_drawn = hits->is_front[i] || meshes[packet->ends[i].mesh].is_double_sided;
        met |= (uint32_t)(hits->is_met[i] && is_drawn) << i;
    }
    return met;
}

/* Sums over the samples that meet the triangle of the first one. */
struct sum {
    double u, v, point[3], direction[3];
    int count;
};

static void add_met(const struct rt_whole_sample *at, int lane, struct sum *sum)
{
    sum->u += at->hits->u[lane];
    sum->v += at->hits->v[lane];
    for (int k = 0; k < 3; k++) {
        sum->point[k] += at->hits->point[k][lane];
        sum->direction[k] += at->rays->direction[k][lane];
    }
    sum->count++;
}

static void begin_sum(const struct rt_whole_sample *at, struct sum *sum)
{
    const int lane = at->lane;
    sum->u = at->hits->u[lane];
    sum->v = at->hits->v[lane];
    for (int k = 0; k < 3; k++) {
        sum->point[k] = at->hits->point[k][lane];
        sum->direction[k] = at->rays->direction[k][lane];
    }
    sum->count = 1;
}

/* Adds a sample, if it sees the surface of the first one. */
static bool is_same_surface(const struct rt_batch *batch, const struct rt_whole_sample *at,
                            int lane, struct sum *sum)
{
    const struct rt_candidate *first = &at->packet->ends[at->lane], *own = &at->packet->ends[lane];
    const struct rt_wide_hits *hits = at->hits;
    if (first->mesh != own->mesh || hits->is_front[at->lane] != hits->is_front[lane])
        return false;
    if (first->triangle == own->triangle) {
        add_met(at, lane, sum);
        return true;
    }
    double known[3], other[3], offset[3];
    for (int k = 0; k < 3; k++) {
        known[k] = hits->normal[k][at->lane];
        other[k] = hits->normal[k][lane];
        offset[k] = hits->point[k][lane] - sum->point[k] / sum->count;
    }
    return rt_batch_continues(batch, known, other, offset, hits->t[lane]);
}

/* A surface of the group's mesh in a pixel. */
struct member {
    int x, y;
    uint32_t triangle;
    double *radiance;
};

/* Returns its lane. The corners of its triangle are the caller's to put there, and where in the
 * triangle it is. */
static int open_lane(const struct rt_batch *batch, struct rt_whole_group *group,
                     const struct member *member)
{
    const struct rt_mesh *mesh = &batch->desc.scene->meshes[group->alike->mesh];
    const uint32_t *vertices = mesh->triangles + 3 * (size_t)member->triangle;
    const int i = group->count++;
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++)
            group->wide.normals[c][k][i] = mesh->normals[3 * (size_t)vertices[c] + (size_t)k];
    group->x[i] = member->x;
    group->y[i] = member->y;
    group->triangles[i] = member->triangle;
    group->radiance[i] = member->radiance;
    return i;
}

static void put_corners(const struct rt_batch *batch, struct rt_whole_group *group, int lane)
{
    const double *corners[3];
    double room[3][3];
    rt_mesh_corners(&batch->desc.scene->meshes[group->alike->mesh], group->triangles[lane], room,
                    corners);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++)
            group->wide.corners[c][k][lane] = corners[c][k];
}

/* In the middle of the pixel's samples. */
static void put_middle(struct rt_whole_group *group, int i, const struct sum *sum, bool is_front)
{
    struct rt_wide *wide = &group->wide;
    for (int k = 0; k < 3; k++) {
        wide->point[k][i] = sum->point[k];
        wide->direction[k][i] = sum->direction[k];
    }
    wide->u[i] = sum->u;
    wide->v[i] = sum->v;
    wide->count[i] = sum->count;
    wide->side[i] = is_front ? 1 : -1;
    group->sought[i] = 0;
}

/* What the group's surfaces cover and let through. */
static void fill_layer(const struct rt_whole_group *group, struct rt_whole_layer *layer)
{
    layer->alpha = group->alike->shading.alpha;
    memcpy(layer->filter, group->alike->shading.filter, sizeof layer->filter);
}

bool rt_wholes_take(struct rt_batch *batch, const struct rt_whole_sample *at)
{
    struct rt_wholes *wholes = batch->wholes;
    const int lane = at->lane, samples = batch->desc.samples;
    const struct rt_candidate *ends = &at->packet->ends[lane];
    struct sum sum;
    begin_sum(at, &sum);
    for (int s = 1; s < samples; s++)
        if (!is_same_surface(batch, at, lane + s, &sum))
            return false;
    struct rt_whole_group *group = rt_whole_open(batch, ends->mesh, ends->triangle);
    struct rt_whole_pixel *pixel = &wholes->pixels[wholes->count++];
    pixel->x = at->x;
    pixel->y = at->y;
    pixel->first_layer = pixel->layer_count = 0;
    pixel->is_open = false;
    pixel->mesh = ends->mesh;
    pixel->is_front = at->hits->is_front[lane];
    pixel->split = 0;
    for (int s = 0; s < samples; s++)
        pixel->triangles[s] = ends[s].triangle;
    const struct member member = {at->x, at->y, ends->triangle, pixel->radiance};
    const int i = open_lane(batch, group, &member);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++)
            group->wide.corners[c][k][i] = at->hits->corners[c][k][lane];
    put_middle(group, i, &sum, pixel->is_front);
    return true;
}

static bool is_layer(const struct rt_scene *scene, const struct rt_hit *hit)
{
    const struct rt_mesh *mesh = &scene->meshes[hit->mesh];
    return mesh->class_ == STATE_TRANSPARENT && mesh->is_plain && !mesh->is_ground &&
           mesh->bend == STATE_BEND_NONE && !hit->is_hidden && !hit->is_left_unseen;
}

/* What one sample's hits are: layers alone, and behind them one surface that may fill a pixel, or
 * none. */
static bool is_stack(const struct rt_scene *scene, const struct rt_hits *hits)
{
    if (hits->has_overflowed || !hits->count)
        return false;
    for (size_t i = 0; i < hits->count; i++) {
        const struct rt_hit *hit = &hits->hits[i];
        bool is_end = hit->is_opaque && rt_whole_may_end(&scene->meshes[hit->mesh]);
        if (!is_end && !is_layer(scene, hit))
            return false;
    }
    return true;
}

static bool continues(const struct rt_batch *batch, const struct rt_hit *known,
                      const struct rt_hit *own, const struct rt_ray *ray, const struct sum *sum)
{
    double normals[2][3], offset[3];
    rt_scene_normal(batch->desc.scene, known, normals[0]);
    rt_scene_normal(batch->desc.scene, own, normals[1]);
    for (int k = 0; k < 3; k++)
        offset[k] = ray->origin[k] + ray->direction[k] * own->t - sum->point[k] / sum->count;
    return rt_batch_continues(batch, normals[0], normals[1], offset, own->t);
}

static void add_hit(const struct rt_hit *hit, const struct rt_ray *ray, struct sum *sum)
{
    const bool is_first = !sum->count++;
    sum->u = is_first ? hit->u : sum->u + hit->u;
    sum->v = is_first ? hit->v : sum->v + hit->v;
    for (int k = 0; k < 3; k++) {
        double point = ray->origin[k] + ray->direction[k] * hit->t;
        sum->point[k] = is_first ? point : sum->point[k] + point;
        sum->direction[k] = is_first ? ray->direction[k] : sum->direction[k] + ray->direction[k];
    }
}

/* Over all samples of the pixel, of the hit with that number. False: they do not see one surface.
 */
static bool sum_hits(const struct rt_batch *batch, const struct rt_whole_sample *at, size_t number,
                     struct sum *sum)
{
    const struct rt_packet *packet = at->packet;
    const struct rt_hit *first = &packet->hits[at->lane].hits[number];
    *sum = (struct sum){0};
    for (int lane = at->lane; lane < at->lane + batch->desc.samples; lane++) {
        const struct rt_hit *hit = &packet->hits[lane].hits[number];
        if (hit->mesh != first->mesh || hit->is_front != first->is_front)
            return false;
        if (hit->triangle == first->triangle)
            add_hit(hit, &packet->rays[lane], sum);
        else if (!first->is_opaque || !continues(batch, first, hit, &packet->rays[lane], sum))
            return false;
    }
    return true;
}

/* Whether all samples see the same surfaces. count: of what the first one sees. */
static bool are_alike(const struct rt_batch *batch, const struct rt_whole_sample *at, size_t count,
                      struct sum sums[LAYERS_MAX])
{
    assert(batch->desc.samples > 0);
    if (!count || count > LAYERS_MAX)
        return false;
    for (int s = 0; s < batch->desc.samples; s++) {
        const struct rt_hits *hits = &at->packet->hits[at->lane + s];
        if (hits->count != count || !is_stack(batch->desc.scene, hits))
            return false;
    }
    for (size_t i = 0; i < count; i++)
        if (!sum_hits(batch, at, i, &sums[i]))
            return false;
    return true;
}

static void add_surface(struct rt_batch *batch, const struct rt_whole_pixel *pixel,
                        const struct rt_hit *hit, const struct sum *sum,
                        struct rt_whole_layer *layer, double *radiance)
{
    struct rt_whole_group *group = rt_whole_open(batch, hit->mesh, hit->triangle);
    const struct member member = {pixel->x, pixel->y, hit->triangle, radiance};
    const int i = open_lane(batch, group, &member);
    put_corners(batch, group, i);
    put_middle(group, i, sum, hit->is_front);
    if (layer)
        fill_layer(group, layer);
}

bool rt_wholes_take_layers(struct rt_batch *batch, const struct rt_whole_sample *at)
{
    struct rt_wholes *wholes = batch->wholes;
    const struct rt_hits *hits = &at->packet->hits[at->lane];
    struct sum sums[LAYERS_MAX];
    const size_t count = hits->count, last = count - 1;
    if (wholes->layer_count + count > RT_WHOLE_LAYERS || !are_alike(batch, at, count, sums))
        return false;
    struct rt_whole_pixel *pixel = &wholes->pixels[wholes->count++];
    *pixel = (struct rt_whole_pixel){.x = at->x,
                                     .y = at->y,
                                     .first_layer = (uint32_t)wholes->layer_count,
                                     .is_open = !hits->hits[last].is_opaque,
                                     .mesh = hits->hits[last].mesh,
                                     .is_front = hits->hits[last].is_front};
    const uint32_t layers = (uint32_t)last + pixel->is_open;
    pixel->layer_count = layers;
    wholes->layer_count += layers;
    for (uint32_t i = 0; i < layers; i++) {
        struct rt_whole_layer *layer = &wholes->layers[pixel->first_layer + i];
        add_surface(batch, pixel, &hits->hits[i], &sums[i], layer, layer->radiance);
    }
    for (int s = 0; s < batch->desc.samples && !pixel->is_open; s++)
        pixel->triangles[s] = at->packet->hits[at->lane + s].hits[last].triangle;
    if (!pixel->is_open)
        add_surface(batch, pixel, &hits->hits[last], &sums[last], NULL, pixel->radiance);
    return true;
}

void rt_wholes_add(struct rt_batch *batch, const struct rt_whole_sample *at,
                   const struct rt_candidate *met, struct rt_whole_layer *layer, double *radiance)
{
    struct rt_whole_group *group = rt_whole_open(batch, met->mesh, met->triangle);
    const struct member member = {at->x, at->y, met->triangle, radiance};
    const int i = open_lane(batch, group, &member);
    double(*ways)[3][RT_WIDE] = batch->wholes->ways[group - batch->wholes->groups];
    put_corners(batch, group, i);
    for (int s = 0; s < batch->desc.samples; s++)
        for (int k = 0; k < 3; k++)
            ways[s][k][i] = at->rays->direction[k][at->lane + s];
    group->wide.count[i] = batch->desc.samples;
    group->sought[i] = 1;
    if (layer)
        fill_layer(group, layer);
}

static bool may_be_layer(const struct rt_mesh *mesh, uint32_t meets)
{
    return mesh->is_plain && (mesh->is_double_sided || (meets & RT_MEETS_FRONT));
}

/* How many sheets all samples of a pixel see. -1: not the same, or they cannot be layers. */
static int count_sheets(const struct rt_batch *batch, const struct rt_whole_sample *at)
{
    struct rt_packet *packet = at->packet;
    const struct rt_mesh *meshes = batch->desc.scene->meshes;
    const uint32_t all = (1u << batch->desc.samples) - 1, ended = packet->ended >> at->lane & all;
    const struct rt_candidate *first = packet->waiting[at->lane], *end = &packet->ends[at->lane];
    if (ended && (ended != all || !rt_whole_may_end(&meshes[end->mesh])))
        return -1;
    const int count = rt_packet_sheets(packet, at->rays, at->lane);
    for (int i = 0; i < count; i++)
        if (!may_be_layer(&meshes[first[i].mesh], first[i].meets))
            return -1;
    for (int s = 1; s < batch->desc.samples && count >= 0; s++) {
        const struct rt_candidate *own = packet->waiting[at->lane + s];
        if ((ended && !rt_candidate_is_same(end, &end[s])) ||
            rt_packet_sheets(packet, at->rays, at->lane + s) != count)
            return -1;
        for (int i = 0; i < count; i++)
            if (!rt_candidate_is_same(&first[i], &own[i]))
                return -1;
    }
    return count;
}

bool rt_wholes_take_sheets(struct rt_batch *batch, const struct rt_whole_sample *at)
{
    struct rt_wholes *wholes = batch->wholes;
    const struct rt_candidate *end = &at->packet->ends[at->lane];
    const struct rt_candidate *sheets = at->packet->waiting[at->lane];
    const int count = count_sheets(batch, at);
    if (count < 0 || wholes->layer_count + (size_t)count > RT_WHOLE_LAYERS)
        return false;
    struct rt_whole_pixel *pixel = &wholes->pixels[wholes->count++];
    pixel->x = at->x;
    pixel->y = at->y;
    pixel->first_layer = (uint32_t)wholes->layer_count;
    pixel->layer_count = (uint32_t)count;
    pixel->is_open = !(at->packet->ended >> at->lane & 1);
    pixel->split = 0;
    wholes->layer_count += (size_t)count;
    for (int i = 0; i < count; i++) {
        struct rt_whole_layer *layer = &wholes->layers[pixel->first_layer + (uint32_t)i];
        rt_wholes_add(batch, at, &sheets[i], layer, layer->radiance);
    }
    if (pixel->is_open)
        return true;
    pixel->mesh = end->mesh;
    pixel->is_front = rt_packet_end_is_front(at->packet, at->lane);
    for (int s = 0; s < batch->desc.samples; s++)
        pixel->triangles[s] = end->triangle;
    rt_wholes_add(batch, at, end, NULL, pixel->radiance);
    return true;
}

void rt_wholes_flush(struct rt_batch *batch)
{
    for (int i = 0; batch->wholes && i < RT_WHOLE_GROUPS && !batch->is_cancelled; i++)
        if (batch->wholes->groups[i].count)
            rt_whole_light_group(batch, &batch->wholes->groups[i]);
}

/* The hits of the samples are found once more: few pixels are split. */
bool rt_wholes_split(struct rt_batch *batch, struct rt_whole_pixel *pixel)
{
    const int samples = batch->desc.samples;
    if (!rt_batch_reserve_fragments(batch, batch->fragment_count + (size_t)samples))
        return false;
    pixel->split = (uint32_t)batch->fragment_count + 1;
    for (int s = 0; s < samples; s++) {
        struct rt_fragment *own = &batch->fragments[batch->fragment_count++];
        struct rt_hits *hits = &batch->scratch;
        const double *place = batch->desc.places[s];
        struct rt_point point = {.bent = 0};
        struct rt_ray ray;
        hits->count = 0;
        rt_job_camera_ray(batch->desc.job, pixel->x + place[0], pixel->y + place[1], &ray);
        bool is_met =
            rt_scene_add_hit(batch->desc.scene, &ray, pixel->mesh, pixel->triangles[s], hits);
        assert(is_met);
        point.hit = hits->hits[0];
        for (int k = 0; k < 3; k++) {
            point.direction[k] = ray.direction[k];
            point.point[k] = ray.origin[k] + ray.direction[k] * point.hit.t;
        }
        *own =
            (struct rt_fragment){.hit = point.hit, .x = pixel->x, .y = pixel->y, .is_opaque = true};
        rt_fragment_add(own, &point);
    }
    return true;
}

/* As composite of rt_batch.c. */
static void write_pixel(const struct rt_batch *batch, const struct rt_whole_pixel *from)
{
    const struct rt_whole_layer *layer = &batch->wholes->layers[from->first_layer];
    double layers[3] = {0}, through[3] = {1, 1, 1}, behind[4];
    struct rt_pixel pixel = {.covered = 0};
    for (uint32_t i = 0; i < from->layer_count; i++, layer++)
        rt_pixel_add_layer(layer->radiance, layer->alpha, layer->filter, layers, through);
    if (from->is_open)
        rt_pixel_background(batch->desc.view, NULL, NULL, behind);
    else
        behind[3] = 1;
    for (int s = 0; s < batch->desc.samples; s++) {
        const double *radiance = from->radiance;
        if (from->split)
            radiance = batch->shadings[from->split - 1 + (uint32_t)s].radiance;
        for (int k = 0; k < 3 && !from->is_open; k++)
            behind[k] = radiance[k];
        rt_pixel_end_sample(&pixel, layers, through, behind);
    }
    rt_pixel_write(&pixel, batch->desc.view, batch->desc.samples,
                   rt_job_pixel(batch->desc.job, from->x, from->y));
}

void rt_wholes_write(struct rt_batch *batch)
{
    struct rt_wholes *wholes = batch->wholes;
    for (size_t i = 0; wholes && i < wholes->count; i++)
        if (rt_job_has_pixel(batch->desc.job, wholes->pixels[i].x, wholes->pixels[i].y))
            write_pixel(batch, &wholes->pixels[i]);
    for (int i = 0; wholes && i < RT_WHOLE_GROUPS; i++)
        wholes->groups[i].count = 0; /* they are not lit where the picture is cancelled */
    if (wholes)
        wholes->count = wholes->layer_count = 0;
}

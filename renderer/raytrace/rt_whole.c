/* SPDX-License-Identifier: MIT */
/* Gathering pixels that one surface fills, and lighting them. */
#include "renderer/raytrace/rt_whole.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/raytrace/rt_batch.h"
#include "renderer/raytrace/rt_batch_light.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_pixel.h"
#include "renderer/raytrace/rt_wide_lists.h"

enum {
    RAYS_UNASKED = 16384, /* shadow rays between two questions whether to go on */
    LAYERS_MAX = 32,      /* of a pixel, with what ends it */
};

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
        made->groups[i].mesh = UINT32_MAX;
    *wholes = made;
    return true;
}

void rt_wholes_destroy(struct rt_wholes *wholes)
{
    free(wholes);
}

static bool may_fill(const struct rt_mesh *mesh)
{
    return mesh->class_ == STATE_OPAQUE && mesh->is_plain && !mesh->is_ground;
}

uint32_t rt_wholes_meet(const struct rt_batch *batch, const struct rt_packet *packet,
                        const struct rt_wide_rays *rays, struct rt_wide_hits *hits)
{
    const struct rt_mesh *meshes = batch->desc.scene->meshes;
    uint32_t lanes = rt_packet_plain_ends(packet), left, met = 0;
    for (left = lanes; left; left &= left - 1) {
        int i = __builtin_ctz(left);
        const struct rt_mesh *mesh = &meshes[packet->ends[i].mesh];
        const double *corners[3];
        double room[3][3];
        if (!may_fill(mesh)) {
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

/* Evaluates what all surfaces of the group's mesh have alike. */
static void evaluate(struct rt_batch *batch, struct rt_whole_group *group, uint32_t triangle)
{
    const struct rt_fragment fragment = {
        .hit = {.mesh = group->mesh, .triangle = triangle, .u = 0.25, .v = 0.25, .is_front = true},
        .is_opaque = batch->desc.scene->meshes[group->mesh].class_ == STATE_OPAQUE};
    const struct rt_lit lit = {.fragment = &fragment,
                               .view = {0, 1, 0},
                               .surface = &group->surface,
                               .reflector = &group->reflector};
    group->shading = (struct rt_shading){.alpha = 1};
    bool is_lit = rt_lit_evaluate(batch, &lit, &group->shading);
    assert(is_lit);
    group->is_evaluated = true;
}

static void light_group(struct rt_batch *batch, struct rt_whole_group *group);

/* With room for one surface more. */
static struct rt_whole_group *open_group(struct rt_batch *batch, uint32_t mesh, uint32_t triangle)
{
    struct rt_whole_group *group = &batch->wholes->groups[mesh % RT_WHOLE_GROUPS];
    if (group->count == RT_WIDE || (group->count && group->mesh != mesh))
        light_group(batch, group);
    if (group->mesh != mesh)
        group->is_evaluated = false;
    group->mesh = mesh;
    if (!group->is_evaluated)
        evaluate(batch, group, triangle);
    return group;
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
    const struct rt_mesh *mesh = &batch->desc.scene->meshes[group->mesh];
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
    rt_mesh_corners(&batch->desc.scene->meshes[group->mesh], group->triangles[lane], room, corners);
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
    layer->alpha = group->shading.alpha;
    memcpy(layer->filter, group->shading.filter, sizeof layer->filter);
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
    struct rt_whole_group *group = open_group(batch, ends->mesh, ends->triangle);
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
        bool is_end = hit->is_opaque && may_fill(&scene->meshes[hit->mesh]);
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

/* Whether all samples see the same surfaces. sums: of as many as the first one sees. */
static bool are_alike(const struct rt_batch *batch, const struct rt_whole_sample *at,
                      struct sum sums[LAYERS_MAX])
{
    const struct rt_hits *first = &at->packet->hits[at->lane];
    assert(batch->desc.samples > 0);
    if (first->count > LAYERS_MAX)
        return false;
    for (int s = 0; s < batch->desc.samples; s++) {
        const struct rt_hits *hits = &at->packet->hits[at->lane + s];
        if (hits->count != first->count || !is_stack(batch->desc.scene, hits))
            return false;
    }
    for (size_t i = 0; i < first->count; i++)
        if (!sum_hits(batch, at, i, &sums[i]))
            return false;
    return true;
}

static void add_surface(struct rt_batch *batch, const struct rt_whole_pixel *pixel,
                        const struct rt_hit *hit, const struct sum *sum,
                        struct rt_whole_layer *layer, double *radiance)
{
    struct rt_whole_group *group = open_group(batch, hit->mesh, hit->triangle);
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
    if (wholes->layer_count + hits->count > RT_WHOLE_LAYERS || !are_alike(batch, at, sums))
        return false;
    const size_t last = hits->count - 1;
    struct rt_whole_pixel *pixel = &wholes->pixels[wholes->count++];
    *pixel = (struct rt_whole_pixel){.x = at->x,
                                     .y = at->y,
                                     .first_layer = (uint32_t)wholes->layer_count,
                                     .is_open = !hits->hits[last].is_opaque,
                                     .mesh = hits->hits[last].mesh,
                                     .is_front = hits->hits[last].is_front};
    pixel->layer_count = (uint32_t)last + pixel->is_open;
    wholes->layer_count += pixel->layer_count;
    for (uint32_t i = 0; i < pixel->layer_count; i++) {
        struct rt_whole_layer *layer = &wholes->layers[pixel->first_layer + i];
        add_surface(batch, pixel, &hits->hits[i], &sums[i], layer, layer->radiance);
    }
    for (int s = 0; s < batch->desc.samples && !pixel->is_open; s++)
        pixel->triangles[s] = at->packet->hits[at->lane + s].hits[last].triangle;
    if (!pixel->is_open)
        add_surface(batch, pixel, &hits->hits[last], &sums[last], NULL, pixel->radiance);
    return true;
}

/* A triangle that the pixel's rays meet, known in f32: light_group finds where. */
static void add_met_triangle(struct rt_batch *batch, const struct rt_whole_sample *at,
                             const struct rt_candidate *met, struct rt_whole_layer *layer,
                             double *radiance)
{
    struct rt_whole_group *group = open_group(batch, met->mesh, met->triangle);
    const struct member member = {at->x, at->y, met->triangle, radiance};
    const int i = open_lane(batch, group, &member);
    put_corners(batch, group, i);
    for (int s = 0; s < batch->desc.samples; s++)
        for (int k = 0; k < 3; k++)
            group->ways[s][k][i] = at->rays->direction[k][at->lane + s];
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
    if (ended && (ended != all || !may_fill(&meshes[end->mesh])))
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
        add_met_triangle(batch, at, &sheets[i], layer, layer->radiance);
    }
    if (pixel->is_open)
        return true;
    pixel->mesh = end->mesh;
    pixel->is_front = rt_packet_end_is_front(at->packet, at->lane);
    for (int s = 0; s < batch->desc.samples; s++)
        pixel->triangles[s] = end->triangle;
    add_met_triangle(batch, at, end, NULL, pixel->radiance);
    return true;
}

static bool is_any_sought(const struct rt_whole_group *group)
{
    uint32_t any = 0;
    for (int i = 0; i < group->count; i++)
        any |= group->sought[i];
    return any;
}

static void place(const struct rt_batch *batch, struct rt_whole_group *group)
{
    const struct rt_scene *scene = batch->desc.scene;
    const struct rt_mesh *mesh = &scene->meshes[group->mesh];
    const struct camera *camera = batch->desc.camera;
    double eye[3];
    vec3_sub(camera->eye, scene->origin, eye);
    if (is_any_sought(group))
        rt_wide_find(eye, mesh->is_mirrored, batch->desc.samples,
                     (const double(*)[3][RT_WIDE])group->ways, group->sought, &group->wide);
    struct rt_wide_mesh alike = {.is_mirrored = mesh->is_mirrored,
                                 .nudge_m = scene->nudge_m,
                                 .is_smoothed = mesh->class_ == STATE_OPAQUE &&
                                                !rt_wide_is_flat(&group->wide, group->count)};
    memcpy(alike.normal_matrix, mesh->normal_matrix, sizeof alike.normal_matrix);
    memcpy(alike.origin, scene->origin, sizeof alike.origin);
    memcpy(alike.eye, camera->eye, sizeof alike.eye);
    memcpy(alike.back, camera->back, sizeof alike.back);
    rt_wide_place(&alike, &group->wide);
    rt_wide_look(&group->reflector, &group->wide);
}

/* What they emit, and reflect of the hemisphere. */
static void begin_light(const struct rt_batch *batch, struct rt_whole_group *group,
                        double radiance[3][RT_WIDE])
{
    const struct scene_state *state = batch->desc.scene->state;
    const struct rt_wide *wide = &group->wide;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < RT_WIDE; i++)
            radiance[k][i] = group->shading.radiance[k];
    for (int i = 0; state->has_environment && i < group->count; i++) {
        struct rt_reflector *reflector = &group->reflector;
        double sum[3];
        for (int k = 0; k < 3; k++) {
            reflector->view[k] = wide->view[k][i];
            group->surface.normal[k] = reflector->normal[k] = wide->normal[k][i];
            sum[k] = radiance[k][i];
        }
        reflector->n_dot_v = wide->n_dot_v[i];
        reflector->seen = wide->seen[i];
        rt_reflect_hemisphere(state, reflector, &group->surface, sum);
        for (int k = 0; k < 3; k++)
            radiance[k][i] = sum[k];
    }
}

/* From which the shadow rays of a group are made one by one, where they meet filters. */
struct maker {
    const struct rt_batch *batch;
    const struct rt_whole_group *group;
};

static void make_ray(const void *from, int lane, struct rt_ray *ray)
{
    const struct maker *maker = from;
    const struct rt_wholes *wholes = maker->batch->wholes;
    const struct rt_scene *scene = maker->batch->desc.scene;
    const struct rt_hit on = {.mesh = maker->group->mesh};
    *ray = (struct rt_ray){.t_min = wholes->rays.t_min[lane],
                           .t_max = wholes->rays.t_max[lane],
                           .skip_mesh = on.mesh,
                           .skip_triangle = maker->group->triangles[lane],
                           .excluded_node = rt_path_excluded_node(scene, &on)};
    for (int k = 0; k < 3; k++) {
        ray->origin[k] = wholes->rays.origin[k][lane];
        ray->direction[k] = wholes->rays.direction[k][lane];
    }
}

/* Traces the shadow rays of the light. Returns the lanes that it reaches; passes: what filters let
 * through. */
static uint32_t pass_shadows(struct rt_batch *batch, const struct rt_whole_group *group,
                             uint32_t lanes)
{
    struct rt_wholes *wholes = batch->wholes;
    const struct rt_scene *scene = batch->desc.scene;
    const struct maker maker = {batch, group};
    const struct rt_wide_way way = {
        .epsilon = scene->epsilon, .size_m = scene->size_m, .nudge_m = scene->nudge_m};
    struct rt_packet *packet = &batch->packet;
    rt_wide_leave(&way, &group->wide, &wholes->light, &wholes->rays);
    packet->count = group->count;
    packet->make = make_ray;
    packet->from = &maker;
    batch->shadow_rays += (uint64_t)__builtin_popcount(lanes);
    lanes = rt_packet_pass(packet, &wholes->rays, lanes,
                           scene->meshes[group->mesh].no_self_shadow ? NULL : wholes->passes);
    for (uint32_t left = lanes & packet->used; left; left &= left - 1) {
        const int i = __builtin_ctz(left);
        double passed[3] = {1, 1, 1}, no_media[3] = {0};
        batch->has_overflowed |= packet->hits[i].has_overflowed;
        if (!packet->hits[i].count)
            continue;
        rt_path_transmittance(scene, &packet->hits[i], rt_packet_ray(packet, i), no_media,
                              batch->desc.view->quality.blend_filter, passed);
        for (int k = 0; k < 3; k++)
            wholes->passes[k][i] = passed[k];
    }
    return lanes;
}

static void ask_light(struct rt_batch *batch, struct rt_whole_group *group, uint32_t light,
                      uint32_t lanes)
{
    struct rt_wholes *wholes = batch->wholes;
    const struct rt_light_record *record = &batch->desc.light_set->records[light];
    uint32_t reaches[RT_WIDE];
    rt_wide_arrive(record, &group->wide, &wholes->light);
    lanes &= rt_wide_lanes(wholes->light.arrives);
    if (!lanes)
        return;
    batch->lights_reaching += (uint64_t)__builtin_popcount(lanes);
    rt_wide_reflect(&group->reflector, record, &group->wide, &wholes->light);
    lanes &= rt_wide_lanes(wholes->light.reflects);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < RT_WIDE; i++)
            wholes->passes[k][i] = 1;
    if (lanes && record->casts_shadow && batch->desc.view->quality.shadows != SHADOWS_NONE)
        lanes = pass_shadows(batch, group, lanes);
    for (int i = 0; i < RT_WIDE; i++)
        reaches[i] = lanes >> i & 1;
    rt_wide_add(&wholes->light, reaches, wholes->passes, wholes->radiance);
}

/* Lights without shadows first, as they are added to fragments. */
static void ask_list(struct rt_batch *batch, struct rt_whole_group *group,
                     const struct rt_light_list *list, uint32_t lanes)
{
    const struct rt_light_record *records = batch->desc.light_set->records;
    batch->lights_listed += list->count * (uint64_t)__builtin_popcount(lanes);
    for (int casts = 0; casts < 2; casts++)
        for (size_t i = 0; i < list->count; i++) {
            uint32_t light = rt_light_list_at(list, i);
            if (records[light].casts_shadow == casts)
                ask_light(batch, group, light, lanes);
        }
}

static void light_group(struct rt_batch *batch, struct rt_whole_group *group)
{
    struct rt_wholes *wholes = batch->wholes;
    struct rt_wide_places places = {.count = group->count, .view_z = group->wide.view_z};
    struct rt_light_list lists[RT_WIDE];
    uint32_t lanes[RT_WIDE];
    place(batch, group);
    begin_light(batch, group, wholes->radiance);
    memcpy(places.x, group->x, sizeof places.x);
    memcpy(places.y, group->y, sizeof places.y);
    batch->surfaces += (uint64_t)group->count;
    int count = rt_wide_lists(batch->desc.light_set, &places, lists, lanes);
    for (int i = 0; i < count; i++)
        ask_list(batch, group, &lists[i], lanes[i]);
    for (int i = 0; i < group->count; i++)
        for (int k = 0; k < 3; k++)
            group->radiance[i][k] = wholes->radiance[k][i];
    group->count = 0;
    if (batch->shadow_rays - wholes->asked_at > RAYS_UNASKED) {
        wholes->asked_at = batch->shadow_rays;
        batch->is_cancelled |= rt_job_is_cancelled(batch->desc.job);
    }
}

void rt_wholes_flush(struct rt_batch *batch)
{
    for (int i = 0; batch->wholes && i < RT_WHOLE_GROUPS && !batch->is_cancelled; i++)
        if (batch->wholes->groups[i].count)
            light_group(batch, &batch->wholes->groups[i]);
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

/* SPDX-License-Identifier: MIT */
/* Counts what the faces of shadow volumes cover of a picture, by a sample of the casters' edges: a
 * side goes from each of which one triangle faces the light and the other does not, and from each
 * that has one triangle; triangles cover it themselves. */
#include <stdlib.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/cost/volume_cover.h"
#include "renderer/shadows/shadow_frame.h"

enum {
    EDGES_MAX = 2048,      /* that are looked at, and of these laid over the picture, */
    FACES_MAX = 128,       /* of each kind and each light, */
    EDGES_OF_MOTION = 512, /* likewise in a view in motion */
    FACES_OF_MOTION = 32,
    LIGHTS_SAMPLED = 4, /* at equal steps; the others are taken to be alike */
};

/* What a face covers besides what is in its outline, over the size of the scene: parts of tiles. */
static const double BORDER = 1. / 128;

struct counter {
    const struct workload_desc *desc;
    struct workload_edge *edges;
    size_t count;
    double border_m;
};

/* ---- edges ---- */

static void take_edge(struct counter *counter, size_t item, const struct edge_pick *pick,
                      double weight)
{
    const struct scene_state *state = counter->desc->state;
    const struct state_geometry geometry = state_geometry_of(state, &state->items[item]);
    struct workload_edge *edge = &counter->edges[counter->count++];
    *edge = (struct workload_edge){
        .is_border = pick->vertices[3] == EDGE_IS_BORDER, .weight = weight, .item = item};
    for (int i = 0; i < (edge->is_border ? 3 : 4); i++)
        state_geometry_point(&geometry, pick->vertices[i], edge->corners[i]);
    for (int i = 0; i < (edge->is_border ? 1 : 2); i++) {
        double sides[2][3];
        vec3_sub(edge->corners[!i], edge->corners[i], sides[0]);
        vec3_sub(edge->corners[2 + i], edge->corners[i], sides[1]);
        vec3_cross(sides[0], sides[1], edge->normals[i]);
    }
}

static size_t most_edges(const struct workload_desc *desc)
{
    return desc->view->quality.may_be_coarse ? EDGES_OF_MOTION : EDGES_MAX;
}

static const struct edge_list *list_of(const struct counter *counter,
                                       const struct edge_picks *picks, size_t item)
{
    static const struct edge_list none = {0};
    const struct state_item *drawn = &counter->desc->state->items[item];
    return drawn->casts_shadow ? &picks->lists[drawn->primitive] : &none;
}

/* Sums of turns and lengths, in the size that the item has in the world. */
static double size_to(const struct counter *counter, size_t item, double turns, double lengths)
{
    double scale = (double)counter->desc->state->items[item].length_scale;
    return counter->border_m * turns + scale * lengths;
}

static double size_before(const struct counter *counter, size_t item,
                          const struct edge_picks *picks, const struct edge_list *list, size_t at)
{
    if (at == list->first)
        return 0;
    return size_to(counter, item, picks->picks[at - 1].turns, picks->picks[at - 1].lengths);
}

/* The first pick whose sum is above `size`, or the list's end. */
static size_t find_pick(const struct counter *counter, size_t item, const struct edge_picks *picks,
                        const struct edge_list *list, double size)
{
    size_t first = list->first, end = list->first + list->count;
    while (first < end) {
        size_t middle = first + (end - first) / 2;
        if (size_before(counter, item, picks, list, middle + 1) > size)
            end = middle;
        else
            first = middle + 1;
    }
    return first;
}

static void take_some(struct counter *counter, size_t item, const struct edge_picks *picks,
                      struct size_steps *steps, size_t most)
{
    const struct edge_list *list = list_of(counter, picks, item);
    double all = size_to(counter, item, list->turns, list->lengths), passed = 0;
    while (passed + steps->next < all && counter->count < most) {
        size_t at = find_pick(counter, item, picks, list, passed + steps->next);
        if (at == list->first + list->count)
            break;
        const struct edge_pick *pick = &picks->picks[at];
        double before = size_before(counter, item, picks, list, at);
        double size = size_before(counter, item, picks, list, at + 1) - before;
        steps->next -= before - passed;
        passed = before + size;
        double hits = size_steps_count(steps, size);
        if (hits > 0)
            take_edge(counter, item, pick, (double)pick->weight * hits * steps->step / size);
    }
    steps->next -= all - passed;
}

static void take_all(struct counter *counter, size_t item, const struct edge_picks *picks)
{
    const struct edge_list *list = list_of(counter, picks, item);
    for (size_t i = list->first; i < list->first + list->count; i++)
        take_edge(counter, item, &picks->picks[i], (double)picks->picks[i].weight);
}

static bool sample_edges(struct counter *counter, struct error *err)
{
    const struct workload_desc *desc = counter->desc;
    const size_t most = most_edges(desc);
    struct edge_picks own = {0}, *picks = desc->kept ? &desc->kept->picks : &own;
    double sizes = 0, count = 0;
    if (!edge_picks_make(picks, desc->state->scene, err))
        return false;
    for (size_t i = 0; i < desc->state->whole_count; i++) {
        const struct edge_list *list = list_of(counter, picks, i);
        sizes += size_to(counter, i, list->turns, list->lengths);
        count += (double)list->count;
    }
    struct size_steps steps = size_steps_begin(sizes, (double)most);
    for (size_t i = 0; i < desc->state->whole_count; i++) {
        if (count <= (double)most)
            take_all(counter, i, picks);
        else
            take_some(counter, i, picks, &steps, most);
    }
    edge_picks_finish(&own);
    return true;
}

/* Those that are kept, or new ones. */
static bool find_edges(struct counter *counter, struct error *err)
{
    const struct workload_kept *kept = counter->desc->kept;
    if (kept && kept->edges) {
        counter->edges = kept->edges;
        counter->count = kept->edge_count;
        return true;
    }
    counter->edges = malloc(most_edges(counter->desc) * sizeof *counter->edges);
    if (!counter->edges)
        return error_set(err, ERROR_NO_MEMORY, "sampling of shadow volumes");
    if (sample_edges(counter, err))
        return true;
    free(counter->edges);
    counter->edges = NULL;
    return false;
}

/* Keeps those of a view in motion, which are 100 kilobytes; others are four times as many, and
 * pictures at rest take longer to draw. */
static void give_edges(struct counter *counter)
{
    struct workload_kept *kept = counter->desc->kept;
    if (!counter->edges)
        return;
    if (kept && counter->desc->view->quality.may_be_coarse) {
        kept->edges = counter->edges;
        kept->edge_count = counter->count;
    } else {
        free(counter->edges);
    }
}

/* ---- faces over the picture ---- */

enum kind { FACE_SIDE, FACE_FIRST, FACE_SECOND, FACE_KINDS }; /* triangles of an edge */

/* Of one light. */
struct faces {
    const struct counter *counter;
    struct volume_cover cover;
    const struct state_light *light;
    bool *is_reached;         /* of each edge */
    double *sizes;            /* room for one of each edge */
    double *most[FACE_KINDS]; /* pixels that the triangles of each edge cover at most */
};

static bool is_facing(const struct state_light *light, const struct workload_edge *edge, int which)
{
    double to_light[3] = {-light->direction[0], -light->direction[1], -light->direction[2]};
    if (light->type != SCENE_LIGHT_DIRECTIONAL)
        vec3_sub(light->position, edge->corners[0], to_light);
    return vec3_dot(to_light, edge->normals[which]) > 0;
}

/* How many faces of the kind there are at edges for which this one stands. A triangle is met from
 * each of its three. */
static double number_of(const struct faces *faces, enum kind kind, size_t at)
{
    const struct workload_edge *edge = &faces->counter->edges[at];
    bool is_there = kind == FACE_SIDE ? edge->is_border || is_facing(faces->light, edge, 0) !=
                                                               is_facing(faces->light, edge, 1)
                                      : kind == FACE_FIRST || !edge->is_border;
    if (!is_there || !faces->is_reached[at])
        return 0;
    return edge->weight / (kind == FACE_SIDE ? 1 : 3);
}

static struct volume_outline outline_of(const struct faces *faces, enum kind kind, size_t at)
{
    const struct workload_edge *edge = &faces->counter->edges[at];
    const struct camera *camera = faces->counter->desc->camera;
    const double *third = edge->corners[kind == FACE_SECOND ? 3 : 2];
    return kind == FACE_SIDE
               ? volume_outline_of_side(camera, faces->light, edge->corners)
               : volume_outline_of_triangle(camera, edge->corners[0], edge->corners[1], third);
}

static double most_of(const struct faces *faces, enum kind kind, size_t at)
{
    if (kind != FACE_SIDE)
        return faces->most[kind][at];
    struct volume_outline outline = outline_of(faces, kind, at);
    return volume_cover_most(&faces->cover, &outline);
}

/* Pixels of all faces of the kind, by a sample of them by what they cover at most. */
static double count_faces(const struct faces *faces, enum kind kind)
{
    const struct counter *counter = faces->counter;
    bool is_moving = counter->desc->view->quality.may_be_coarse;
    double all = 0, pixels = 0, wanted = is_moving ? FACES_OF_MOTION : FACES_MAX;
    size_t found = 0;
    for (size_t i = 0; i < counter->count; i++) {
        double number = number_of(faces, kind, i);
        faces->sizes[i] = number > 0 ? number * most_of(faces, kind, i) : 0;
        all += faces->sizes[i];
        found += faces->sizes[i] > 0;
    }
    struct size_steps steps = size_steps_begin(all, wanted);
    for (size_t i = 0; i < counter->count; i++) {
        double share = faces->sizes[i] > 0;
        if (share > 0 && (double)found > wanted)
            share = size_steps_count(&steps, faces->sizes[i]) * steps.step / faces->sizes[i];
        if (!(share > 0))
            continue;
        struct volume_outline outline = outline_of(faces, kind, i);
        pixels += share * number_of(faces, kind, i) * volume_cover_measure(&faces->cover, &outline);
    }
    return pixels;
}

/* Edges of one item follow each other. */
static void find_reached(const struct faces *faces, const struct shadow_frame *frame)
{
    const struct counter *counter = faces->counter;
    for (size_t i = 0; i < counter->count; i++) {
        size_t item = counter->edges[i].item;
        faces->is_reached[i] = i > 0 && counter->edges[i - 1].item == item
                                   ? faces->is_reached[i - 1]
                                   : shadow_frame_faces(frame, &counter->desc->state->items[item]);
    }
}

static void count_light(struct workload *workload, struct faces *faces,
                        const struct scene_sampling *sampling, const struct state_light *light)
{
    const struct workload_desc *desc = faces->counter->desc;
    struct shadow_frame frame;
    if (!shadow_frame_init(&frame, light, desc->state, SHADOW_RESOLUTION_DEFAULT))
        return;
    volume_cover_init(&faces->cover, desc, sampling, light);
    faces->light = light;
    find_reached(faces, &frame);
    for (int kind = 0; kind < FACE_KINDS; kind++)
        workload->face_pixels += count_faces(faces, (enum kind)kind);
}

static bool faces_init(struct faces *faces, const struct counter *counter, struct error *err)
{
    const struct view *view = counter->desc->view;
    const struct volume_cover picture = {
        .camera = counter->desc->camera, .width_px = view->width_px, .height_px = view->height_px};
    *faces = (struct faces){.counter = counter,
                            .is_reached = calloc(counter->count + 1, sizeof *faces->is_reached),
                            .sizes = calloc(3 * counter->count + 1, sizeof *faces->sizes)};
    if (!faces->is_reached || !faces->sizes)
        return error_set(err, ERROR_NO_MEMORY, "sampling of shadow volumes");
    for (int kind = FACE_FIRST; kind <= FACE_SECOND; kind++) {
        faces->most[kind] = faces->sizes + (size_t)kind * counter->count;
        for (size_t i = 0; i < counter->count; i++) {
            struct volume_outline outline = outline_of(faces, (enum kind)kind, i);
            faces->most[kind][i] = volume_cover_most(&picture, &outline);
        }
    }
    return true;
}

static bool count_lights(struct workload *workload, const struct counter *counter,
                         const struct scene_sampling *sampling, const struct light_reach *reach,
                         struct error *err)
{
    const struct scene_state *state = counter->desc->state;
    size_t step = (workload->lights + LIGHTS_SAMPLED - 1) / LIGHTS_SAMPLED;
    size_t visible = 0, taken = 0;
    struct faces faces;
    bool ok = faces_init(&faces, counter, err);
    for (size_t i = 0; ok && i < state->light_count; i++) {
        const struct state_light *light = &state->lights[i];
        if (!reach->is_in_view[i] || visible++ % step != 0)
            continue;
        taken++;
        if (light->casts_shadow && !state_light_is_area(light))
            count_light(workload, &faces, sampling, light);
    }
    workload->face_pixels *= taken ? (double)workload->lights / (double)taken : 0;
    free(faces.is_reached);
    free(faces.sizes);
    return ok;
}

bool workload_measure_volumes(struct workload *workload, const struct workload_desc *desc,
                              const struct scene_sampling *sampling,
                              const struct light_reach *reach, struct error *err)
{
    struct counter counter = {.desc = desc};
    double size[3];
    vec3_sub(desc->state->bounds_max, desc->state->bounds_min, size);
    counter.border_m = BORDER * vec3_length(size);
    if (!workload->shadowed_lights)
        return true;
    bool ok = find_edges(&counter, err);
    if (ok && counter.count)
        ok = count_lights(workload, &counter, sampling, reach, err);
    give_edges(&counter);
    return ok;
}

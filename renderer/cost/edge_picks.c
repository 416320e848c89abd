/* SPDX-License-Identifier: MIT */
/* Runs of triangles of each primitive whose edges are found by where their ends are, and of these a
 * sample by size. */
#include "renderer/cost/edge_picks.h"

#include <stdlib.h>

#include "renderer/base/matrix.h"

enum {
    TRIANGLES_MAX = 65536, /* whose edges are found, of all primitives, */
    TRIANGLES_LEAST = 32,  /* and of each */
    PICKS_MAX = 10240,     /* a third of the edges that are kept */
    PICKS_LEAST = 4,
    LOOKS_MAX = 64,
    RUN = 256, /* triangles in the file's order: two rows of a grid of sixty */
};
static const double GOLDEN = 0.6180339887498949; /* steps of it lie evenly, however many */

/* So that triangles in one plane, which no side goes from, are found for what they cover
 * themselves. */
static const double TURN_LEAST = 0.1;
static const double TURN_OF_BORDER = 2; /* as of two that lie on each other */

/* What an edge has besides its length, over the size of its primitive: some pixels about it. */
static const double BORDER = 1. / 128;

struct size_steps size_steps_begin(double total, double wanted)
{
    double step = wanted > 0 && total > 0 ? total / wanted : INFINITY;
    return (struct size_steps){.step = step, .next = step / 2};
}

double size_steps_count(struct size_steps *steps, double size)
{
    double count = steps->next < size ? floor((size - steps->next) / steps->step) + 1 : 0;
    steps->next += (count > 0 ? count * steps->step : 0) - size;
    return count;
}

/* ---- edges of a run ---- */

struct edge {
    uint32_t vertices[4];
    uint32_t triangle, apart; /* the first one, and how much later the second comes */
    double turn, length;
    double weight; /* edges that it stands for */
};

struct finder {
    const float *positions;  /* of the primitive's vertices */
    const uint32_t *indices; /* likewise */
    struct edge *edges;
    uint32_t count;
    uint32_t *slots;     /* 1 + index of an edge by its hash; 0: none */
    uint32_t slot_count; /* a power of two, at least twice as many as edges */
};

static const float *place_of(const struct finder *finder, uint32_t vertex)
{
    return finder->positions + 3 * (size_t)vertex;
}

static bool are_same(const struct finder *finder, uint32_t a, uint32_t b)
{
    const float *p = place_of(finder, a), *q = place_of(finder, b);
    return a == b || (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]);
}

static uint32_t hash_place(const float *place)
{
    uint32_t hash = 0;
    for (int k = 0; k < 3; k++) {
        float value = place[k] + 0.0f; /* -0 is 0 */
        uint32_t bits;
        memcpy(&bits, &value, sizeof bits);
        hash = (hash ^ bits) * 0x9e3779b1u; /* golden ratio */
        hash ^= hash >> 15;
    }
    return hash;
}

/* An edge that has no second triangle yet takes this one; else it is a new one. Where too many lie
 * in one place it is left out. */
static void add_edge(struct finder *finder, uint32_t a, uint32_t b, uint32_t third,
                     uint32_t triangle)
{
    uint32_t mask = finder->slot_count - 1, looks = 0;
    uint32_t at = hash_place(place_of(finder, a)) + hash_place(place_of(finder, b));
    for (at &= mask; finder->slots[at]; at = (at + 1) & mask) {
        if (++looks > LOOKS_MAX)
            return;
        struct edge *edge = &finder->edges[finder->slots[at] - 1];
        const uint32_t *v = edge->vertices;
        if (v[3] == EDGE_IS_BORDER && ((are_same(finder, v[0], b) && are_same(finder, v[1], a)) ||
                                       (are_same(finder, v[0], a) && are_same(finder, v[1], b)))) {
            edge->vertices[3] = third;
            edge->apart = triangle - edge->triangle;
            return;
        }
    }
    finder->edges[finder->count++] =
        (struct edge){.vertices = {a, b, third, EDGE_IS_BORDER}, .triangle = triangle, .weight = 1};
    finder->slots[at] = finder->count;
}

static void normal_of(const struct finder *finder, const uint32_t v[3], double normal[3])
{
    double sides[2][3];
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++)
            sides[i][k] = (double)place_of(finder, v[i + 1])[k] - (double)place_of(finder, v[0])[k];
    vec3_cross(sides[0], sides[1], normal);
}

static void measure_edge(const struct finder *finder, struct edge *edge)
{
    const uint32_t *v = edge->vertices;
    double normals[2][3], square = 0, cosine = 0; /* of lines: as of a right angle */
    for (int k = 0; k < 3; k++) {
        double along = (double)place_of(finder, v[1])[k] - (double)place_of(finder, v[0])[k];
        square += along * along;
    }
    edge->length = sqrt(square);
    edge->turn = TURN_LEAST + TURN_OF_BORDER;
    if (v[3] == EDGE_IS_BORDER)
        return;
    normal_of(finder, v, normals[0]);
    normal_of(finder, (const uint32_t[3]){v[1], v[0], v[3]}, normals[1]);
    double sizes = vec3_dot(normals[0], normals[0]) * vec3_dot(normals[1], normals[1]);
    if (sizes > 0)
        cosine = vec3_dot(normals[0], normals[1]) / sqrt(sizes);
    edge->turn = TURN_LEAST + sqrt(fmax(2 - 2 * cosine, 0)); /* a chord */
}

static uint32_t slots_for(uint32_t triangles)
{
    uint32_t slots = 8;
    while (slots < 6 * triangles)
        slots *= 2;
    return slots;
}

/* Adds the edges of some triangles: of part of a primitive those of two triangles that are not too
 * far apart. Of such, a run of `count` somewhere in so many triangles holds one of `count - apart`.
 */
static void find_run(struct finder *finder, uint32_t first, uint32_t count, double among)
{
    bool is_whole = among <= count;
    uint32_t begin = finder->count;
    finder->slot_count = slots_for(count);
    memset(finder->slots, 0, finder->slot_count * sizeof *finder->slots);
    for (uint32_t t = first; t < first + count; t++) {
        const uint32_t *v = finder->indices + 3 * (size_t)t;
        for (int i = 0; i < 3; i++)
            add_edge(finder, v[i], v[(i + 1) % 3], v[(i + 2) % 3], t);
    }
    uint32_t kept = begin;
    for (uint32_t i = begin; i < finder->count; i++) {
        struct edge edge = finder->edges[i];
        if (!is_whole && (edge.vertices[3] == EDGE_IS_BORDER || 4 * edge.apart > 3 * count))
            continue;
        edge.weight = is_whole ? 1 : among / (count - edge.apart);
        measure_edge(finder, &edge);
        finder->edges[kept++] = edge;
    }
    finder->count = kept;
}

/* ---- a primitive ---- */

static uint32_t triangles_of(const struct scene_primitive *primitive)
{
    return primitive->topology == SCENE_TRIANGLES ? primitive->index_count / 3 : 0;
}

/* How many of a primitive, where all primitives together have `most`: by the roots of their
 * numbers, so that small primitives have more than their share. */
static uint32_t share_of(uint32_t triangles, double roots, double most, double least)
{
    double share = fmax(ceil(most * sqrt(triangles) / fmax(roots, 1)), least);
    return (uint32_t)fmin(triangles, share);
}

/* Edges whose triangles are too far apart are taken to be like those that were found. */
static void stand_for_all(struct finder *finder, double edges)
{
    double found = 0;
    for (uint32_t i = 0; i < finder->count; i++)
        found += finder->edges[i].weight;
    for (uint32_t i = 0; i < finder->count; i++)
        finder->edges[i].weight *= edges / found;
}

/* All triangles where they are no more than that; else runs of them, each somewhere in its part of
 * the file. */
static void find_edges(struct finder *finder, uint32_t triangles, uint32_t most)
{
    uint32_t run = most < RUN ? most : RUN, runs = most / run;
    finder->count = 0;
    if (most == triangles) {
        find_run(finder, 0, triangles, triangles);
        return;
    }
    for (uint32_t i = 0; i < runs; i++) {
        double part = (double)triangles / runs, room = part - run;
        uint32_t first = (uint32_t)(i * part + fmod((i + 0.5) * GOLDEN, 1) * room);
        find_run(finder, first, run, part);
    }
    bool is_soup = !finder->count;
    if (is_soup)
        find_run(finder, 0, run, run);
    stand_for_all(finder, (is_soup ? 3 : 1.5) * triangles);
}

static double size_of(const struct edge *edge, double border)
{
    return edge->weight * edge->turn * (edge->length + border);
}

static void pick(struct edge_picks *picks, struct edge_list *list, const struct finder *finder,
                 double border, double wanted)
{
    double total = 0;
    for (uint32_t i = 0; i < finder->count; i++)
        total += size_of(&finder->edges[i], border);
    struct size_steps steps = size_steps_begin(total, wanted);
    list->first = picks->count;
    for (uint32_t i = 0; i < finder->count; i++) {
        const struct edge *edge = &finder->edges[i];
        double size = size_of(edge, border), stands = edge->weight;
        if (wanted < finder->count)
            stands *= size_steps_count(&steps, size) * steps.step / size;
        if (!(stands > 0))
            continue;
        list->turns += stands * edge->turn;
        list->lengths += stands * edge->turn * edge->length;
        struct edge_pick *made = &picks->picks[picks->count++];
        *made = (struct edge_pick){
            .weight = (float)stands, .turns = list->turns, .lengths = list->lengths};
        memcpy(made->vertices, edge->vertices, sizeof made->vertices);
    }
    list->count = picks->count - list->first;
}

struct room {
    double roots;
    uint32_t triangles;
    size_t picks;
};

static struct room find_room(const struct scene *scene)
{
    struct room room = {0};
    for (uint32_t p = 0; p < scene->primitive_count; p++)
        room.roots += sqrt(triangles_of(&scene->primitives[p]));
    for (uint32_t p = 0; p < scene->primitive_count; p++) {
        uint32_t all = triangles_of(&scene->primitives[p]);
        uint32_t looked_at = share_of(all, room.roots, TRIANGLES_MAX, TRIANGLES_LEAST);
        room.triangles = looked_at > room.triangles ? looked_at : room.triangles;
        room.picks += 3 * (size_t)share_of(all, room.roots, PICKS_MAX, PICKS_LEAST) + 1;
    }
    return room;
}

static void pick_all(struct edge_picks *picks, const struct scene *scene, double roots,
                     struct finder *finder)
{
    for (uint32_t p = 0; p < scene->primitive_count; p++) {
        const struct scene_primitive *primitive = &scene->primitives[p];
        const struct scene *from = scene_of_primitive(scene, primitive);
        uint32_t all = triangles_of(primitive);
        double size[3];
        if (!all)
            continue;
        for (int k = 0; k < 3; k++)
            size[k] = (double)primitive->bounds_max[k] - (double)primitive->bounds_min[k];
        finder->positions = from->positions + 3 * (size_t)primitive->first_vertex;
        finder->indices = from->indices + primitive->first_index;
        find_edges(finder, all, share_of(all, roots, TRIANGLES_MAX, TRIANGLES_LEAST));
        pick(picks, &picks->lists[p], finder, BORDER * vec3_length(size),
             3. * share_of(all, roots, PICKS_MAX, PICKS_LEAST));
    }
}

/* A composed scene has the serial of its base. */
static struct content_key key_of(const struct scene *scene)
{
    struct content_key key = content_key_begin();
    content_key_add_word(&key, scene->serial);
    for (uint32_t i = 0; i < scene->part_count; i++)
        content_key_add_word(&key, scene->parts[i].scene->serial);
    return key;
}

bool edge_picks_make(struct edge_picks *picks, const struct scene *scene, struct error *err)
{
    struct content_key key = key_of(scene);
    struct room room = find_room(scene);
    struct finder finder = {0};
    if (picks->lists && content_key_equals(picks->key, key))
        return true;
    edge_picks_finish(picks);
    finder.edges = malloc((3 * (size_t)room.triangles + 1) * sizeof *finder.edges);
    finder.slots = malloc(slots_for(room.triangles) * sizeof *finder.slots);
    picks->lists = calloc((size_t)scene->primitive_count + 1, sizeof *picks->lists);
    picks->picks = malloc((room.picks + 1) * sizeof *picks->picks);
    bool ok = finder.edges && finder.slots && picks->lists && picks->picks;
    if (ok) {
        pick_all(picks, scene, room.roots, &finder);
        picks->key = key;
    } else {
        error_set(err, ERROR_NO_MEMORY, "sampling of shadow volumes");
        edge_picks_finish(picks);
    }
    free(finder.edges);
    free(finder.slots);
    return ok;
}

void edge_picks_finish(struct edge_picks *picks)
{
    free(picks->lists);
    free(picks->picks);
    *picks = (struct edge_picks){.lists = NULL};
}

/* SPDX-License-Identifier: MIT */
/* Vertices are found by their position's bits. */
#include "renderer/shadows/volume_casters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/polygon_clip.h"
#include "renderer/shadows/caster_filter.h"
#include "renderer/shadows/volume_chunks.h"

struct content_key volume_casters_key(const struct scene_state *state, const char *scene_key)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, scene_key);
    content_key_add(&key, &state->scene->indices, sizeof state->scene->indices);
    content_key_add_word(&key, state->shadow_plane_count);
    content_key_add(&key, state->shadow_planes,
                    state->shadow_plane_count * sizeof *state->shadow_planes);
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        if (!item->casts_shadow)
            continue;
        content_key_add_word(&key, i);
        content_key_add_word(&key, item->shadow_hash);
    }
    return key;
}

/* ---- vertices ---- */

struct building {
    struct volume_casters *casters;
    size_t vertex_capacity, triangle_capacity;
    uint32_t *slots;   /* 1 + vertex; 0: free */
    size_t slot_count; /* a power of two, more than twice the vertices */
};

static bool grow(void **array, size_t *capacity, size_t size, struct error *err)
{
    size_t wanted = *capacity ? 2 * *capacity : 1024;
    void *grown = wanted <= UINT32_MAX / 8 ? realloc(*array, wanted * size) : NULL;
    if (!grown)
        return error_set(err, ERROR_NO_MEMORY, "%zu parts of shadow volumes", wanted);
    *array = grown;
    *capacity = wanted;
    return true;
}

static size_t slot_of(const struct building *building, const double point[3])
{
    uint64_t words[3], hash = 0x9e3779b97f4a7c15ull;
    memcpy(words, point, sizeof words);
    for (int k = 0; k < 3; k++) {
        hash = (hash ^ words[k]) * 0xff51afd7ed558ccdull;
        hash ^= hash >> 32;
    }
    return (size_t)hash & (building->slot_count - 1);
}

static void place(struct building *building, uint32_t vertex)
{
    size_t slot = slot_of(building, building->casters->vertices[vertex]);
    while (building->slots[slot])
        slot = (slot + 1) & (building->slot_count - 1);
    building->slots[slot] = vertex + 1;
}

static bool grow_vertices(struct building *building, struct error *err)
{
    struct volume_casters *casters = building->casters;
    void *vertices = casters->vertices;
    bool ok = grow(&vertices, &building->vertex_capacity, sizeof *casters->vertices, err);
    casters->vertices = vertices;
    if (!ok)
        return false;
    free(building->slots);
    building->slot_count = 4 * building->vertex_capacity;
    building->slots = calloc(building->slot_count, sizeof *building->slots);
    if (!building->slots)
        return error_set(err, ERROR_NO_MEMORY, "%zu vertices of shadow volumes",
                         building->vertex_capacity);
    for (size_t i = 0; i < casters->vertex_count; i++)
        place(building, (uint32_t)i);
    return true;
}

static bool is_same(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static bool find_vertex(struct building *building, const double at[3], uint32_t *vertex,
                        struct error *err)
{
    struct volume_casters *casters = building->casters;
    double point[3];
    for (int k = 0; k < 3; k++)
        point[k] = at[k] + 0.0; /* -0 is 0 */
    bool is_full = !building->slots || casters->vertex_count == building->vertex_capacity;
    if (is_full && !grow_vertices(building, err))
        return false;
    size_t slot = slot_of(building, point);
    while (building->slots[slot]) {
        *vertex = building->slots[slot] - 1;
        if (is_same(casters->vertices[*vertex], point))
            return true;
        slot = (slot + 1) & (building->slot_count - 1);
    }
    *vertex = (uint32_t)casters->vertex_count++;
    memcpy(casters->vertices[*vertex], point, sizeof point);
    building->slots[slot] = *vertex + 1;
    return true;
}

/* ---- triangles ---- */

static void sort(uint32_t *a, uint32_t *b)
{
    uint32_t low = *a < *b ? *a : *b;
    *b = *a < *b ? *b : *a;
    *a = low;
}

/* One that is no more than a line casts no shadow. */
static bool add_triangle(struct building *building, const double *const corners[3], size_t item,
                         struct error *err)
{
    struct volume_casters *casters = building->casters;
    uint32_t v[3];
    for (int i = 0; i < 3; i++)
        if (!find_vertex(building, corners[i], &v[i], err))
            return false;
    sort(&v[0], &v[1]);
    sort(&v[1], &v[2]);
    sort(&v[0], &v[1]);
    if (v[0] == v[1] || v[1] == v[2])
        return true;
    if (casters->triangle_count == building->triangle_capacity) {
        void *triangles = casters->triangles;
        bool ok = grow(&triangles, &building->triangle_capacity, sizeof *casters->triangles, err);
        casters->triangles = triangles;
        if (!ok)
            return false;
    }
    uint32_t *triangle = casters->triangles[casters->triangle_count++];
    memcpy(triangle, v, sizeof v);
    triangle[3] = (uint32_t)item;
    return true;
}

/* What clip planes leave of it. */
static bool add_cut(struct building *building, const struct scene_state *state,
                    double (*corners)[3], uint32_t planes, size_t item, struct error *err)
{
    int count = 3;
    for (size_t i = 0; i < state->shadow_plane_count && count >= 3; i++)
        if (planes >> i & 1)
            count = polygon_clip(state->shadow_planes[i], corners, count);
    for (int i = 2; i < count; i++) {
        const double *const triangle[3] = {corners[0], corners[i - 1], corners[i]};
        if (!add_triangle(building, triangle, item, err))
            return false;
    }
    return true;
}

static bool add_item(struct building *building, const struct scene_state *state, size_t i,
                     struct error *err)
{
    const struct state_item *item = &state->items[i];
    const struct state_geometry geometry = state_geometry_of(state, item);
    uint32_t planes = 0;
    if (!item->cap && !state_planes_meet(state->shadow_planes, state->shadow_plane_count,
                                         item->bounds_min, item->bounds_max, &planes))
        return true;
    for (size_t k = 0; k + 3 <= geometry.primitive->index_count; k += 3) {
        double corners[POLYGON_CORNERS_MAX + 1][3];
        for (size_t c = 0; c < 3; c++)
            state_geometry_corner(&geometry, k + c, corners[c]);
        if (!add_cut(building, state, corners, planes, i, err))
            return false;
    }
    return true;
}

bool volume_casters_init(struct volume_casters *casters, const struct scene_state *state,
                         uint64_t faces_most, struct error *err)
{
    struct building building = {.casters = casters};
    bool ok = true;
    for (size_t i = 0; ok && i < state->item_count; i++)
        ok = !state->items[i].casts_shadow || add_item(&building, state, i, err);
    free(building.slots);
    ok = ok && volume_chunks_find(casters, faces_most, err);
    if (!ok)
        volume_casters_finish(casters);
    return ok;
}

void volume_casters_finish(struct volume_casters *casters)
{
    free(casters->vertices);
    free(casters->edges);
    free(casters->sides);
    free(casters->triangles);
    free(casters->parts);
    free(casters->chunks);
    *casters = (struct volume_casters){.vertices = NULL};
}

/* ---- filters ---- */

/* Less than this is nothing: two hundred surfaces of it are what a sum of 32 bits holds. */
static const double LEAST = 0x1p-20;

struct volume_weight volume_weight_of(const struct scene_state *state,
                                      const struct state_item *item, enum view_blend_filter blend)
{
    struct volume_weight weight = {.stops = 0};
    double filter[3];
    caster_filter_of(state, item, blend, filter);
    for (int k = 0; k < 3; k++) {
        if (filter[k] < LEAST)
            weight.stops |= 1u << k;
        else
            weight.log2[k] = (uint32_t)rint(-log2(fmin(filter[k], 1)) * (1 << VOLUME_WEIGHT_BITS));
    }
    return weight;
}

size_t volume_group_of(const struct volume_weight *groups, size_t count,
                       const struct volume_weight *weight)
{
    size_t i = 0;
    while (i < count && memcmp(&groups[i], weight, sizeof *weight) != 0)
        i++;
    return i;
}

size_t volume_groups_find(const struct scene_state *state, enum view_blend_filter blend,
                          struct volume_weight groups[VOLUME_GROUPS_MOST])
{
    size_t count = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        if (!state->items[i].casts_shadow)
            continue;
        const struct volume_weight weight = volume_weight_of(state, &state->items[i], blend);
        if (volume_group_of(groups, count, &weight) < count)
            continue;
        if (count == VOLUME_GROUPS_MOST)
            return count + 1;
        groups[count++] = weight;
    }
    return count;
}

bool volume_groups_check(size_t groups, enum view_silhouette_form form, struct error *err)
{
    if (form == VIEW_SILHOUETTE_COMPUTE || groups <= VOLUME_GROUPS_MOST)
        return true;
    return error_set(err, ERROR_UNSUPPORTED,
                     "casters of more than %d filters: silhouette_form must be compute, which "
                     "adds logarithms of them",
                     (int)VOLUME_GROUPS_MOST);
}

double volume_weight_filter(const struct volume_weight *weight, int channel)
{
    if (channel > 2)
        return 1;
    return weight->stops >> channel & 1 ? 0
                                        : exp2(-ldexp(weight->log2[channel], -VOLUME_WEIGHT_BITS));
}

/* SPDX-License-Identifier: MIT */
/* Casters of a light: which items they are, and what follows from them. */
#include "renderer/shadows/shadow_casters.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static bool reserve_casters(struct shadow_casters *casters, struct error *err)
{
    if (casters->count < casters->capacity)
        return true;
    size_t capacity = casters->capacity ? 2 * casters->capacity : 64;
    uint32_t *items = realloc(casters->items, capacity * sizeof *items);
    if (items)
        casters->items = items;
    uint8_t *faces = items ? realloc(casters->faces, capacity) : NULL;
    if (!faces)
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow casters", capacity);
    casters->faces = faces;
    casters->capacity = capacity;
    return true;
}

/* At least as far as any point of the item, in the depth that events have. */
static double farthest_depth(const struct shadow_frame *frame, const struct state_item *item)
{
    double offset[3];
    vec3_sub(item->center, frame->origin, offset);
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    return item->radius_m + (is_flat ? vec3_dot(frame->axis[2], offset) : vec3_length(offset));
}

/* Caps are cut already. */
static bool meets_planes(const struct scene_state *state, const struct state_item *item,
                         uint32_t *through)
{
    *through = 0;
    return item->cap || state_planes_meet(state->shadow_planes, state->shadow_plane_count,
                                          item->bounds_min, item->bounds_max, through);
}

/* A flat one along an axis is crossed once; others may be crossed more often. */
static bool is_pane(const struct state_item *item)
{
    const double hair = 1e-6; /* of the radius: positions are rounded */
    double thinnest = item->radius_m;
    for (int k = 0; k < 3; k++)
        thinnest = fmin(thinnest, item->bounds_max[k] - item->bounds_min[k]);
    return thinnest <= hair * item->radius_m;
}

bool shadow_casters_collect(struct shadow_casters *casters, const struct shadow_frame *frame,
                            const struct scene_state *state, struct error *err)
{
    casters->grid_count = state->grid_count;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        uint32_t faces = item->casts_shadow ? shadow_frame_faces(frame, item) : 0, planes;
        if (!faces || !meets_planes(state, item, &planes))
            continue;
        if (!reserve_casters(casters, err))
            return false;
        casters->items[casters->count] = (uint32_t)i;
        casters->faces[casters->count++] = (uint8_t)faces;
        if (item->class_ != STATE_TRANSPARENT) {
            casters->opaque_count++;
            casters->opaque_planes |= planes;
            continue;
        }
        const struct state_material *material = &state->materials[item->material];
        casters->has_bodies |= !is_pane(item);
        casters->has_layers |= casters->transparent_count++ > 0 || !is_pane(item);
        casters->transparent_planes |= planes;
        casters->farthest_m = fmax(casters->farthest_m, farthest_depth(frame, item));
        if (material->no_self_shadow || material->cast_once)
            casters->has_exclusions = true;
        casters->has_media |= item->is_medium;
    }
    return true;
}

void shadow_casters_count(const struct shadow_casters *casters, uint32_t face_count,
                          const struct scene_state *state, uint64_t *drawn, uint64_t *culled)
{
    uint64_t seen = 0, all = 0;
    for (size_t i = 0; i < casters->count; i++)
        seen += (uint64_t)__builtin_popcount(casters->faces[i]);
    for (size_t i = 0; i < state->item_count; i++)
        all += state->items[i].casts_shadow;
    *drawn += seen;
    *culled += all * face_count - seen;
}

void shadow_casters_cut(const struct shadow_casters *casters, const struct scene_state *state,
                        struct shadow_map *map)
{
    uint32_t through = casters->opaque_planes |
                       (map->method->structure->filters ? casters->transparent_planes : 0);
    for (size_t i = 0; i < state->shadow_plane_count; i++)
        if (through >> i & 1)
            memcpy(map->planes[map->plane_count++], state->shadow_planes[i], sizeof *map->planes);
}

void shadow_casters_finish(struct shadow_casters *casters)
{
    free(casters->items);
    free(casters->faces);
    *casters = (struct shadow_casters){0};
}

bool shadow_casters_copy(const struct shadow_casters *casters, struct shadow_casters *copy,
                         struct error *err)
{
    size_t count = casters->count;
    *copy = *casters;
    copy->capacity = count;
    copy->items = malloc((count + 1) * sizeof *copy->items);
    copy->faces = malloc(count + 1);
    if (!copy->items || !copy->faces) {
        shadow_casters_finish(copy);
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow casters", count);
    }
    memcpy(copy->items, casters->items, count * sizeof *copy->items);
    memcpy(copy->faces, casters->faces, count);
    return true;
}

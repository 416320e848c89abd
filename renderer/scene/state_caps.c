/* SPDX-License-Identifier: MIT */
/* Meshes and drawables that a state adds to those of its scene. */
#include "renderer/scene/state_caps.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/fnv.h"
#include "renderer/base/matrix.h"

static bool reserve(void **array, size_t count, size_t size)
{
    void *grown = realloc(*array, (count + 1) * size);
    if (grown)
        *array = grown;
    return grown;
}

bool state_caps_reserve(struct scene_state *state, size_t points, struct error *err)
{
    struct state_caps *caps = &state->caps;
    size_t total = caps->vertex_count + points;
    void *list = caps->caps, *items = state->items, *materials = state->materials;
    void *positions = caps->positions, *normals = caps->normals, *indices = caps->indices;
    bool ok = reserve(&list, caps->count + 1, sizeof *caps->caps) &&
              reserve(&items, state->item_count + 1, sizeof *state->items) &&
              reserve(&materials, state->material_count + 1, sizeof *state->materials) &&
              reserve(&positions, total, 3 * sizeof(float)) &&
              reserve(&normals, total, 3 * sizeof(float)) &&
              reserve(&indices, total, sizeof(uint32_t));
    caps->caps = list, state->items = items, state->materials = materials;
    caps->positions = positions, caps->normals = normals, caps->indices = indices;
    return ok || error_set(err, ERROR_NO_MEMORY, "caps of %zu points", total);
}

struct state_cap state_caps_begin(const struct scene_state *state, const double origin[3])
{
    return (struct state_cap){
        .primitive = {.topology = SCENE_TRIANGLES,
                      .first_vertex = state->caps.vertex_count,
                      .first_index = state->caps.vertex_count,
                      .flags = SCENE_PRIMITIVE_HAS_NORMALS,
                      .bounds_min = {FLT_MAX, FLT_MAX, FLT_MAX},
                      .bounds_max = {-FLT_MAX, -FLT_MAX, -FLT_MAX}},
        .world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, origin[0], origin[1], origin[2], 1}};
}

void state_caps_add_vertex(struct state_caps *caps, struct state_cap *cap, const double local[3],
                           const double normal[3])
{
    size_t at = cap->primitive.first_vertex + cap->primitive.vertex_count;
    for (int k = 0; k < 3; k++) {
        float value = (float)local[k];
        caps->positions[3 * at + (size_t)k] = value;
        caps->normals[3 * at + (size_t)k] = (float)normal[k];
        cap->primitive.bounds_min[k] = fminf(cap->primitive.bounds_min[k], value);
        cap->primitive.bounds_max[k] = fmaxf(cap->primitive.bounds_max[k], value);
    }
    caps->indices[at] = cap->primitive.vertex_count++;
    caps->vertex_count++;
}

void state_caps_add_item(struct scene_state *state, struct state_cap *cap, struct state_item item)
{
    struct state_caps *caps = &state->caps;
    size_t bytes = 3 * sizeof(float) * cap->primitive.vertex_count;
    cap->primitive.index_count = cap->primitive.vertex_count;
    item.is_mirrored = item.is_medium = false;
    item.length_scale = 1;
    item.cap = (uint32_t)caps->count + 1;
    item.deformed = 0;
    double diagonal[3];
    for (int k = 0; k < 3; k++) {
        item.bounds_min[k] = cap->world[12 + k] + (double)cap->primitive.bounds_min[k];
        item.bounds_max[k] = cap->world[12 + k] + (double)cap->primitive.bounds_max[k];
        item.center[k] = 0.5 * (item.bounds_min[k] + item.bounds_max[k]);
    }
    vec3_sub(item.bounds_max, item.bounds_min, diagonal);
    item.radius_m = 0.5 * vec3_length(diagonal);
    item.shadow_hash = fnv_add(item.shadow_hash, cap->world, sizeof cap->world);
    item.shadow_hash =
        fnv_add(item.shadow_hash, caps->positions + 3 * (size_t)cap->primitive.first_vertex, bytes);
    caps->caps[caps->count++] = *cap;
    state->items[state->item_count++] = item;
}

void state_caps_finish(struct state_caps *caps)
{
    free(caps->caps);
    free(caps->positions);
    free(caps->normals);
    free(caps->indices);
    *caps = (struct state_caps){0};
}

/* SPDX-License-Identifier: MIT */
/* From what a light needs to the programs of its structure. */
#include "renderer/shadows/shadow_programs.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "renderer/shadows/shadow_media.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

void shadow_map_describe(struct shadow_map *map, const struct shadow_need *need,
                         const struct scene_state *state, const struct view_quality *quality,
                         double allowed_error)
{
    const struct shadow_casters *casters = &need->casters;
    map->frame = need->frame;
    map->method = need->method;
    shadow_casters_cut(casters, state, map);
    if (need->method->structure->describe)
        need->method->structure->describe(map, casters, quality, allowed_error);
}

void shadow_features_add(struct shadow_features *features, const struct shadow_map *map)
{
    const struct shadow_structure *structure = map->method->structure;
    bool is_flat = map->frame.shape == SHADOW_ORTHOGRAPHIC;
    features->has[SHADOW_FEATURE_MAPS] = true;
    features->has[SHADOW_FEATURE_ORTHOGRAPHIC] |= is_flat;
    features->has[SHADOW_FEATURE_PERSPECTIVE] |= !is_flat;
    features->looks_up[map->method->id] |= map->method->lookup != NULL;
    features->has[SHADOW_FEATURE_CUBES] |= map->frame.shape == SHADOW_CUBE;
    if (structure->add_features)
        structure->add_features(features, map);
}

void shadow_features_join(struct shadow_features *features, const struct shadow_features *more)
{
    for (int i = 0; i < SHADOW_FEATURES; i++)
        features->has[i] |= more->has[i];
    for (int id = 0; id < SHADOWS_COUNT; id++)
        features->looks_up[id] |= more->looks_up[id];
}

static size_t add_text(char text[SHADOW_DEFINES_BYTES], size_t length, const char *more)
{
    length += (size_t)snprintf(text + length, SHADOW_DEFINES_BYTES - length, "%s", more);
    assert(length < SHADOW_DEFINES_BYTES);
    return length;
}

/* As shaders/shadows/shadow_lists.glsl reads them. */
static size_t write_lists(const struct shadow_features *features, char text[SHADOW_DEFINES_BYTES],
                          size_t length)
{
    bool is_first = true;
    for (int id = 0; id < SHADOWS_COUNT; id++) {
        char item[64];
        if (!features->looks_up[id])
            continue;
        snprintf(item, sizeof item, "%s%s:%d", is_first ? " SHADOW_LISTS=" : ",",
                 shadow_method_of((enum shadow_technique)id)->lookup, id);
        length = add_text(text, length, item);
        is_first = false;
    }
    return length;
}

void shadow_features_write(const struct shadow_features *features, char text[SHADOW_DEFINES_BYTES])
{
    static const char *const items[SHADOW_FEATURES] = {
        [SHADOW_FEATURE_MAPS] = "SHADOW_HAS_MAPS",
        [SHADOW_FEATURE_ORTHOGRAPHIC] = " SHADOW_HAS_ORTHOGRAPHIC",
        [SHADOW_FEATURE_PERSPECTIVE] = " SHADOW_HAS_PERSPECTIVE",
        [SHADOW_FEATURE_CUBES] = " SHADOW_HAS_CUBES",
        [SHADOW_FEATURE_IDS] = " SHADOW_HAS_IDS",
        [SHADOW_FEATURE_FAITHFUL] = " SHADOW_FAITHFUL",
        [SHADOW_FEATURE_MEDIA] = " SHADOW_HAS_MEDIA",
        [SHADOW_FEATURE_NODES] = " SHADOW_HAS_NODES",
        [SHADOW_FEATURE_SEARCHED] = "",
        [SHADOW_FEATURE_LONG] = " SHADOW_HAS_LONG",
        [SHADOW_FEATURE_PARTITIONS] = " SHADOW_HAS_PARTITIONS",
    };
    size_t length = 0;
    text[0] = 0;
    for (int i = 0; i < SHADOW_FEATURES; i++)
        if (features->has[i])
            length = add_text(text, length, items[i]);
    (void)write_lists(features, text, length);
}

static void list_light(const struct shadow_programs_desc *desc, const struct shadow_need *need,
                       const struct shadow_map *map, struct program_list *list)
{
    const struct shadow_scene scene = {.gpu = desc->gpu,
                                       .state = desc->state,
                                       .blend_filter = (uint32_t)desc->quality->blend_filter};
    const struct shadow_listing listing = {
        .view = {.is_layered = desc->ways.layers_faces, .map = map, .scene = &scene},
        .casters = &need->casters,
        .scans_on_host = desc->ways.scans_on_host};
    shadow_depth_pass.list_programs(&shadow_depth_pass, &listing, list);
    for (const struct shadow_pass *pass = need->method->structure->passes; pass->name; pass++)
        if (!pass->is_of_nodes || map->flags & SHADOW_FLAG_NODES)
            pass->list_programs(pass, &listing, list);
}

struct shadow_features shadow_list_programs(const struct shadow_programs_desc *desc,
                                            struct program_list *list)
{
    struct shadow_features features = {.has = {false}};
    for (size_t i = 0; i < desc->needs->light_count; i++) {
        const struct shadow_need *need = &desc->needs->lights[i];
        struct shadow_map map = {.resolution = desc->resolution};
        if (!need->has_structure)
            continue;
        shadow_map_describe(&map, need, desc->state, desc->quality, 0);
        shadow_features_add(&features, &map);
        shadow_media_at(desc->state, &need->casters, &map);
        list_light(desc, need, &map, list);
    }
    return features;
}

/* A light with an end may be out of reach of what a camera sees. */
static bool is_always_seen(const struct state_light *light)
{
    return light->type == SCENE_LIGHT_DIRECTIONAL || light->range <= 0;
}

static void add_optional(struct shadow_feature_sets *sets, const struct shadow_map *map)
{
    struct shadow_features features = {.has = {false}};
    shadow_features_add(&features, map);
    for (size_t i = 0; i < sets->optional_count; i++)
        if (!memcmp(&sets->optional[i], &features, sizeof features))
            return;
    if (sets->optional_count < SHADOW_FEATURE_SETS_MAX) {
        sets->optional[sets->optional_count++] = features;
        return;
    }
    sets->has_more = true;
    shadow_features_add(&sets->always, map);
}

static struct shadow_feature_sets list_features(const struct shadow_programs_desc *desc,
                                                bool in_batches)
{
    struct shadow_feature_sets sets = {0};
    for (size_t i = 0; i < desc->needs->light_count; i++) {
        const struct shadow_need *need = &desc->needs->lights[i];
        struct shadow_map map = {.resolution = desc->resolution};
        if (!need->has_structure)
            continue;
        shadow_map_describe(&map, need, desc->state, desc->quality, 0);
        if (!in_batches && is_always_seen(&desc->state->lights[i]))
            shadow_features_add(&sets.always, &map);
        else
            add_optional(&sets, &map);
    }
    return sets;
}

struct shadow_feature_sets shadow_list_features(const struct shadow_programs_desc *desc)
{
    return list_features(desc, false);
}

struct shadow_feature_sets shadow_list_batch_features(const struct shadow_programs_desc *desc)
{
    return list_features(desc, true);
}

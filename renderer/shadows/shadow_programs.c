/* SPDX-License-Identifier: MIT */
/* From what a light needs to the programs of its structure. */
#include "renderer/shadows/shadow_programs.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "renderer/gl/buffer_fill.h"
#include "renderer/shadows/caster_variants.h"
#include "renderer/shadows/shadow_compress.h"
#include "renderer/shadows/shadow_deep_job.h"
#include "renderer/shadows/shadow_media.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

/* Up to this many events of a list, halving it takes no more reads than its keys: four at most.
 * With keys it is three texels of them, and the event. */
enum { SHORT_LIST = SHADOW_SHORT_LIST };

/* Whether its lists are searched for an event. */
static bool is_searched(const struct shadow_map *map)
{
    return map->kind == SHADOW_DEEP && !(map->flags & (SHADOW_FLAG_NODES | SHADOW_FLAG_RAW));
}

void shadow_map_describe(struct shadow_map *map, const struct shadow_need *need,
                         const struct scene_state *state, const struct view_quality *quality,
                         double allowed_error)
{
    const struct shadow_casters *casters = &need->casters;
    map->frame = need->frame;
    map->kind = need->kind;
    shadow_casters_cut(casters, state, map);
    map->is_faithful = map->kind == SHADOW_LINKED && quality->faithful;
    if (map->kind == SHADOW_DEEP && casters->has_exclusions)
        map->flags |= SHADOW_FLAG_RAW;
    if (map->kind == SHADOW_DEEP && casters->has_media)
        map->flags |= SHADOW_FLAG_MEDIA;
    shadow_compress_choose(map, casters, quality, allowed_error);
}

void shadow_features_add(struct shadow_features *features, const struct shadow_map *map)
{
    const bool has[SHADOW_FEATURES] = {
        true,
        map->frame.shape == SHADOW_ORTHOGRAPHIC,
        map->frame.shape != SHADOW_ORTHOGRAPHIC,
        map->frame.shape == SHADOW_CUBE,
        map->kind == SHADOW_DEEP,
        (map->flags & SHADOW_FLAG_RAW) != 0,
        map->kind == SHADOW_LINKED,
        map->is_faithful,
        (map->flags & SHADOW_FLAG_MEDIA) != 0,
        (map->flags & SHADOW_FLAG_NODES) != 0,
        [SHADOW_FEATURE_SEARCHED] = is_searched(map),
        [SHADOW_FEATURE_LONG] = is_searched(map) && map->longest_list > SHORT_LIST,
    };
    for (int i = 0; i < SHADOW_FEATURES; i++)
        features->has[i] |= has[i];
}

void shadow_features_write(const struct shadow_features *features, char text[SHADOW_DEFINES_BYTES])
{
    static const char *const items[SHADOW_FEATURES] = {
        "SHADOW_HAS_MAPS",    " SHADOW_HAS_ORTHOGRAPHIC", " SHADOW_HAS_PERSPECTIVE",
        " SHADOW_HAS_CUBES",  " SHADOW_HAS_DEEP",         " SHADOW_HAS_IDS",
        " SHADOW_HAS_LINKED", " SHADOW_FAITHFUL",         " SHADOW_HAS_MEDIA",
        " SHADOW_HAS_NODES",  "" /* searched */,          " SHADOW_HAS_LONG"};
    size_t length = 0;
    text[0] = 0;
    for (int i = 0; i < SHADOW_FEATURES; i++)
        if (features->has[i])
            length +=
                (size_t)snprintf(text + length, SHADOW_DEFINES_BYTES - length, "%s", items[i]);
    assert(length < SHADOW_DEFINES_BYTES);
}

static void list_deep(struct caster_view *view, const struct shadow_casters *casters,
                      bool scans_on_host, struct program_list *list)
{
    view->pass = CASTER_COUNT;
    if (!scans_on_host)
        buffer_fill_list_programs("shadow.deep.count", list);
    caster_list_programs(view, casters, "shadow.deep.count", false, list);
    if (!scans_on_host)
        deep_scan_list_programs(list);
    view->pass = CASTER_SCATTER;
    caster_list_programs(view, casters, "shadow.deep.scatter", true, list);
    deep_sort_list_programs(view->map->flags, scans_on_host, list);
}

/* The exact lists are those of a map of their own. */
static void list_compressed(struct caster_view *view, const struct shadow_casters *casters,
                            bool scans_on_host, struct program_list *list)
{
    const struct shadow_map *map = view->map;
    struct shadow_map fine = *map;
    fine.flags = shadow_compress_fine_flags(map);
    view->map = &fine;
    list_deep(view, casters, scans_on_host, list);
    view->map = map;
    shadow_compress_list_programs(map, list);
}

static void list_light(const struct shadow_programs_desc *desc, const struct shadow_need *need,
                       const struct shadow_map *map, struct program_list *list)
{
    const struct shadow_scene scene = {.gpu = desc->gpu,
                                       .state = desc->state,
                                       .blend_filter = (uint32_t)desc->quality->blend_filter};
    struct caster_view view = {
        .pass = CASTER_DEPTH, .is_layered = desc->ways.layers_faces, .map = map, .scene = &scene};
    const struct shadow_casters *casters = &need->casters;
    caster_list_programs(&view, casters, "shadow.depth", false, list);
    if (map->flags & SHADOW_FLAG_NODES)
        list_compressed(&view, casters, desc->ways.scans_on_host, list);
    else if (map->kind == SHADOW_DEEP)
        list_deep(&view, casters, desc->ways.scans_on_host, list);
    if (map->kind != SHADOW_LINKED)
        return;
    view.pass = map->is_faithful ? CASTER_LINK_FAITHFUL : CASTER_LINK;
    if (!desc->ways.scans_on_host)
        buffer_fill_list_programs("shadow.linked", list);
    caster_list_programs(&view, casters, "shadow.linked", false, list);
    shadow_linked_list_programs(map->is_faithful, list);
}

struct shadow_features shadow_list_programs(const struct shadow_programs_desc *desc,
                                            struct program_list *list)
{
    struct shadow_features features = {{false}};
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
    struct shadow_features features = {{false}};
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

/* SPDX-License-Identifier: MIT */
/* `composited`: composited translucent shadows, Modisett 2023, 5.1 and 5.2. Transparent casters are
 * divided into partitions, none of whose meshes casts a shadow on another of the same
 * (shadow_partitions.h); a translucent shadow map of what is nearer to the light is made for each.
 * There the map is made anew before each partition is composited. Here the maps are layers of one
 * structure, and each surface asks that of its own mesh, so that the lists of a pixel order what is
 * seen. `faithful`: a partition for each mesh, whose casters are all drawn anew. */
#include "renderer/frame_report.h"
#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_partitions.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/shadow_texels.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

#include <stdlib.h>

static void add_features(struct shadow_features *features, const struct shadow_map *map)
{
    (void)map;
    features->has[SHADOW_FEATURE_PARTITIONS] = true;
}

static bool divide(struct shadow_build *build, const struct scene_state *state, struct error *err)
{
    struct shadow_map *map = build->map;
    const struct shadow_partitions_desc desc = {
        .map = map, .state = state, .casters = &build->casters, .light = build->light};
    struct shadow_partitions partitions;
    bool ok = shadow_partitions_find(&partitions, &desc, err);
    map->layers = partitions.count;
    map->wanted_layers = partitions.wanted;
    map->crossed_meshes = partitions.crossed;
    build->partitions = partitions.of_casters; /* the build's from now on */
    return ok;
}

/* The first word: how many nodes it knows. Then where the texels of each node's partition begin,
 * from the map's first on; 0, as for what is opaque: those of layer 0, behind all casters. */
static uint32_t *make_table(const struct shadow_build *build, const struct scene_state *state,
                            uint64_t *words, struct error *err)
{
    uint32_t nodes = 0;
    for (size_t i = 0; i < build->casters.count; i++) {
        uint32_t node = state->items[build->casters.items[i]].node;
        if (build->partitions[i] != SHADOW_NO_PARTITION && node >= nodes)
            nodes = node + 1;
    }
    uint32_t *table = calloc((size_t)nodes + 1, sizeof *table);
    if (!table) {
        error_set(err, ERROR_NO_MEMORY, "partitions of %u nodes", nodes);
        return NULL;
    }
    table[0] = nodes;
    for (size_t i = 0; i < build->casters.count; i++) {
        uint32_t node = state->items[build->casters.items[i]].node;
        uint32_t partition = build->partitions[i];
        if (partition != SHADOW_NO_PARTITION)
            table[1 + node] =
                partition ? partition * (uint32_t)shadow_map_texels(build->map) : SHADOW_ALL_LIT;
    }
    *words = (uint64_t)nodes + 1;
    return table;
}

static bool build(struct shadow_builder *builder, const struct shadow_building *building,
                  struct error *err)
{
    bool ok = true;
    for (size_t i = 0; ok && i < building->count; i++) {
        struct shadow_build *one = &building->builds[i];
        uint64_t words = 0;
        if (one->map->method->structure != building->structure)
            continue;
        uint32_t *table = make_table(one, building->scene->state, &words, err);
        ok = table && shadow_texels_write_table(builder->store, one->map, table, words, err);
        free(table);
    }
    return ok && shadow_texels_build(builder, building, err);
}

static void report(const struct shadow_map *const *maps, size_t count, struct frame_report *report)
{
    struct report_partitions *all = &report->partitions;
    *all = (struct report_partitions){0};
    for (size_t i = 0; i < count; i++) {
        const struct shadow_map *map = maps[i];
        if (!map || map->method->structure != &shadow_structure_composited)
            continue;
        all->lights++;
        all->merged += map->wanted_layers > map->layers;
        all->crossed += map->crossed_meshes > 0;
        all->most = map->wanted_layers > all->most ? map->wanted_layers : all->most;
        all->most_crossed =
            map->crossed_meshes > all->most_crossed ? map->crossed_meshes : all->most_crossed;
    }
}

static void warn(struct frame_report *report)
{
    const struct report_partitions *all = &report->partitions;
    if (all->merged)
        report_warn(report,
                    "composited: %zu of %zu lights need more than %u partitions, one of them %u: "
                    "meshes behind the last but one cast no shadow on each other",
                    all->merged, all->lights, SHADOW_PARTITIONS_MAX, all->most);
    if (all->crossed)
        report_warn(report,
                    "composited: %zu of %zu lights see transparent meshes whose depths overlap, "
                    "one of them %u: their middles order them",
                    all->crossed, all->lights, all->most_crossed);
}

static const struct shadow_pass passes[] = {
    {.name = "shadow.composited",
     .casters = {CASTER_PRODUCT, CASTER_PRODUCT},
     .list_programs = shadow_texels_list_programs},
    {.name = NULL},
};

static const struct shadow_trial trials[] = {
    {"composited", {.shadows = SHADOWS_COMPOSITED}},
    {"composited, faithful", {.shadows = SHADOWS_COMPOSITED, .faithful = true}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_composited = {SHADOW_TABLE_STRUCTURE,
                                                             .passes = passes,
                                                             .trials = trials,
                                                             .forecast = forecast_add_layered_maps,
                                                             .forecast_error = forecast_maps_error,
                                                             .texel_bytes = 20,
                                                             .describe = shadow_texels_describe,
                                                             .add_features = add_features,
                                                             .divide = divide,
                                                             .build = build,
                                                             .report = report,
                                                             .warn = warn};

const struct shadow_method shadow_method_composited = {.id = SHADOWS_COMPOSITED,
                                                       .structure = &shadow_structure_composited,
                                                       .reused = "shadow.composited",
                                                       .lookup = "composited",
                                                       .otherwise = &shadow_method_map,
                                                       .wants = shadow_wants_transparent};

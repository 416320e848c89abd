/* SPDX-License-Identifier: MIT */
/* `deep-linked`: lists that are sorted as their elements are inserted (shadow_deep.h). Lindbeck
 * 2015. A light without a transparent caster has a plain map, but for lists as published, whose
 * opaque casters are elements, too. */
#include "renderer/frame_report.h"
#include "renderer/gl/buffer_fill.h"
#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_linked_grids.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

static bool wants(const struct shadow_casters *casters, const struct view_quality *quality)
{
    return casters->transparent_count > 0 ||
           (quality->faithful && (casters->count > 0 || casters->grid_count > 0));
}

static bool holds_grids(const struct view_quality *quality)
{
    return quality->faithful;
}

static void describe(struct shadow_map *map, const struct shadow_casters *casters,
                     const struct view_quality *quality, double allowed_error)
{
    (void)allowed_error;
    map->is_faithful = quality->faithful;
    map->holds_grids = quality->faithful && casters->grid_count > 0;
}

static void add_features(struct shadow_features *features, const struct shadow_map *map)
{
    features->has[SHADOW_FEATURE_FAITHFUL] |= map->is_faithful;
}

static void list_insertion(const struct shadow_pass *pass, const struct shadow_listing *listing,
                           struct program_list *list)
{
    struct caster_view view = listing->view;
    view.pass = view.map->is_faithful ? CASTER_LINK_FAITHFUL : CASTER_LINK;
    if (!listing->scans_on_host)
        buffer_fill_list_programs(pass->name, list);
    caster_list_programs(&view, listing->casters, pass->name, false, list);
    if (view.map->holds_grids)
        shadow_linked_list_grids(view.scene->state, list);
}

static void list_walk(const struct shadow_pass *pass, const struct shadow_listing *listing,
                      struct program_list *list)
{
    (void)pass;
    shadow_linked_list_programs(listing->view.map->is_faithful, list);
}

static const struct shadow_pass passes[] = {
    {.name = "shadow.linked", .list_programs = list_insertion},
    {.name = "shadow.linked.walk", .list_programs = list_walk},
    {.name = NULL},
};

static bool build(struct shadow_builder *builder, const struct shadow_building *b,
                  struct error *err)
{
    return shadow_linked_build(builder, b->builds, b->count, b->scene, b->because, err);
}

/* ---- what shading and reports know of the lists ---- */

static bool is_exact(const struct view_quality *quality)
{
    return !quality->faithful;
}

static void fill_record(const struct shadow_map *map, struct shadow_record *record)
{
    record->event_base = (uint32_t)map->nodes.first;
}

static void bind(const struct shadow_store *store)
{
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_HEADS, 0), UNIT_SHADOW_HEADS);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_NODES, 0), UNIT_SHADOW_NODES);
}

static void report(const struct shadow_map *const *maps, size_t count, struct frame_report *report)
{
    size_t lights = 0;
    unsigned long long failures = 0;
    for (size_t i = 0; i < count; i++) {
        const struct shadow_map *map = maps[i];
        if (!map || map->method->structure != &shadow_structure_linked)
            continue;
        lights += map->lock_failures > 0;
        failures += map->lock_failures;
    }
    if (lights)
        report_warn(report,
                    "deep-linked: %llu elements of %zu lights found no lock; the lists of these "
                    "lights were made again without locks, with the same shadows",
                    failures, lights);
}

static bool drop(struct shadow_store *store, struct shadow_map *map, struct error *err)
{
    return shadow_store_free(store, SHADOW_POOL_HEADS, &map->heads, err) &&
           shadow_store_free(store, SHADOW_POOL_NODES, &map->nodes, err);
}

static const struct shadow_trial trials[] = {
    {"deep-linked", {.shadows = SHADOWS_DEEP_LINKED}},
    {"deep-linked, faithful", {.shadows = SHADOWS_DEEP_LINKED, .faithful = true}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_linked = {.scope = SHADOW_PER_LIGHT,
                                                         .passes = passes,
                                                         .trials = trials,
                                                         .forecast = forecast_add_maps,
                                                         .forecast_error = forecast_maps_error,
                                                         .texel_bytes = 8, /* depth and head */
                                                         .filters = true,
                                                         .has_lists = true,
                                                         .has_nodes = true,
                                                         .is_walked = true,
                                                         .follows_depths = true,
                                                         .is_exact = is_exact,
                                                         .holds_grids = holds_grids,
                                                         .describe = describe,
                                                         .add_features = add_features,
                                                         .build = build,
                                                         .record = fill_record,
                                                         .bind = bind,
                                                         .report = report,
                                                         .drop = drop};

const struct shadow_method shadow_method_linked = {.id = SHADOWS_DEEP_LINKED,
                                                   .structure = &shadow_structure_linked,
                                                   .reused = "shadow.deep-linked",
                                                   .lookup = "linked",
                                                   .otherwise = &shadow_method_map,
                                                   .wants = wants};

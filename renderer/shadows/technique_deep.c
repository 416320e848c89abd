/* SPDX-License-Identifier: MIT */
/* `deep`: every transmittance event of a texel in one contiguous, sorted list (shadow_deep.h), and
 * on request its compression (shadow_compress.h). A light without a transparent caster has a plain
 * map. */
#include <math.h>

#include "renderer/base/matrix.h"
#include "renderer/frame_report.h"
#include "renderer/gl/buffer_fill.h"
#include "renderer/shadows/shadow_compress.h"
#include "renderer/shadows/shadow_deep_job.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

static void describe(struct shadow_map *map, const struct shadow_casters *casters,
                     const struct view_quality *quality, double allowed_error)
{
    if (casters->has_exclusions)
        map->flags |= SHADOW_FLAG_RAW;
    if (casters->has_media)
        map->flags |= SHADOW_FLAG_MEDIA;
    shadow_compress_choose(map, casters, quality, allowed_error);
    map->keeps_exact =
        casters->has_exclusions && (shadow_compress_is_asked(quality) || allowed_error > 0);
    map->keys_per_m = (float)(SHADOW_KEY_MOST / fmax(casters->farthest_m, 1e-6));
}

static void add_features(struct shadow_features *features, const struct shadow_map *map)
{
    bool is_searched = !(map->flags & (SHADOW_FLAG_NODES | SHADOW_FLAG_RAW)); /* for an event */
    features->has[SHADOW_FEATURE_IDS] |= (map->flags & SHADOW_FLAG_RAW) != 0;
    features->has[SHADOW_FEATURE_MEDIA] |= (map->flags & SHADOW_FLAG_MEDIA) != 0;
    features->has[SHADOW_FEATURE_NODES] |= (map->flags & SHADOW_FLAG_NODES) != 0;
    features->has[SHADOW_FEATURE_SEARCHED] |= is_searched;
    features->has[SHADOW_FEATURE_LONG] |= is_searched && map->longest_list > SHADOW_SHORT_LIST;
}

/* Compressed lists are read before the exact ones of the next light take their memory. */
static bool build(struct shadow_builder *builder, const struct shadow_building *b,
                  struct error *err)
{
    return shadow_deep_build(builder, b->builds, b->count, b->scene, b->because, err) &&
           shadow_compress_build(builder, b->builds, b->count, b->scene, b->because, err);
}

/* ---- programs ---- */

/* The exact lists of a compressed map are those of a map of their own. */
static struct shadow_map exact_map(const struct shadow_map *map)
{
    struct shadow_map exact = *map;
    if (map->flags & SHADOW_FLAG_NODES)
        exact.flags = shadow_compress_fine_flags(map);
    return exact;
}

static void list_casters(const struct shadow_pass *pass, const struct shadow_listing *listing,
                         enum caster_pass caster_pass, struct program_list *list)
{
    struct caster_view view = listing->view;
    const struct shadow_map exact = exact_map(view.map);
    view.map = &exact;
    view.pass = caster_pass;
    caster_list_programs(&view, listing->casters, pass->name, pass->is_conditional, list);
}

static void list_count(const struct shadow_pass *pass, const struct shadow_listing *listing,
                       struct program_list *list)
{
    if (!listing->scans_on_host)
        buffer_fill_list_programs(pass->name, list);
    list_casters(pass, listing, CASTER_COUNT, list);
}

static void list_scan(const struct shadow_pass *pass, const struct shadow_listing *listing,
                      struct program_list *list)
{
    (void)pass;
    if (!listing->scans_on_host)
        deep_scan_list_programs(list);
}

static void list_scatter(const struct shadow_pass *pass, const struct shadow_listing *listing,
                         struct program_list *list)
{
    list_casters(pass, listing, CASTER_SCATTER, list);
}

static void list_sort(const struct shadow_pass *pass, const struct shadow_listing *listing,
                      struct program_list *list)
{
    (void)pass;
    deep_sort_list_programs(exact_map(listing->view.map).flags, listing->scans_on_host, list);
}

static void list_compress(const struct shadow_pass *pass, const struct shadow_listing *listing,
                          struct program_list *list)
{
    (void)pass;
    shadow_compress_list_programs(listing->view.map, list);
}

static const struct shadow_pass passes[] = {
    {.name = "shadow.deep.count", .list_programs = list_count},
    {.name = "shadow.deep.scan", .list_programs = list_scan},
    {.name = "shadow.deep.scatter", .is_conditional = true, .list_programs = list_scatter},
    {.name = "shadow.deep.sort", .is_conditional = true, .list_programs = list_sort},
    {.name = "shadow.deep.compress", .is_of_nodes = true, .list_programs = list_compress},
    {.name = NULL},
};

/* ---- what shading and reports know of the lists ---- */

static void fill_record(const struct shadow_map *map, struct shadow_record *record)
{
    record->event_base = (uint32_t)map->events.first;
    record->projection.v[3] = map->keys_per_m;
    for (int k = 0; k < 3; k++)
        record->sigma.v[k] = (float)map->sigma[k];
}

static void bind(const struct shadow_store *store)
{
    static const struct {
        int stream;
        uint32_t unit;
    } views[] = {
        {SHADOW_STREAM_EVENT, UNIT_SHADOW_EVENTS},
        {SHADOW_STREAM_KEYS, UNIT_SHADOW_KEYS},
        {SHADOW_STREAM_OBJECT, UNIT_SHADOW_ID},
        {SHADOW_STREAM_MEDIUM, UNIT_SHADOW_MEDIA},
    };
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_HEADS, 0), UNIT_SHADOW_HEADS);
    for (size_t i = 0; i < sizeof views / sizeof *views; i++)
        gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, views[i].stream),
                        views[i].unit);
}

/* The light stands in too many media, where they are cut away. */
static bool has_cut_light(const struct shadow_map *map)
{
    bool is_cut = false;
    for (uint32_t i = 0; i < map->plane_count; i++)
        is_cut |= vec3_dot(map->planes[i], map->frame.origin) + map->planes[i][3] < 0;
    return is_cut && vec3_length(map->sigma) > 0;
}

static void report(const struct shadow_map *const *maps, size_t count, struct frame_report *report)
{
    struct report_compression *c = &report->compression;
    size_t kept_exact = 0, cut = 0;
    for (size_t i = 0; i < count; i++) {
        const struct shadow_map *map = maps[i];
        if (!map || map->method->structure != &shadow_structure_deep)
            continue;
        if (map->flags & SHADOW_FLAG_NODES)
            shadow_compress_report(map, c);
        kept_exact += map->keeps_exact;
        cut += has_cut_light(map);
    }
    if (kept_exact)
        report_warn(report,
                    "%zu of %zu lights with deep lists meet a material without self shadow, or one "
                    "that casts once: they keep exact lists, neither compressed nor prefiltered",
                    kept_exact, kept_exact + (size_t)c->maps);
    if (cut)
        report_warn(report,
                    "a light stands in more than %d media, in a part that is cut away: its maps "
                    "attenuate from the light on; traced shadows do from the cut on",
                    SHADOW_AROUND_MAX);
}

static bool drop(struct shadow_store *store, struct shadow_map *map, struct error *err)
{
    return shadow_store_free(store, SHADOW_POOL_HEADS, &map->heads, err) &&
           shadow_store_free(store, SHADOW_POOL_EVENTS, &map->events, err);
}

static const struct shadow_trial trials[] = {
    {"deep", {.shadows = SHADOWS_DEEP}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_deep = {.scope = SHADOW_PER_LIGHT,
                                                       .passes = passes,
                                                       .trials = trials,
                                                       .forecast = forecast_add_maps,
                                                       .forecast_error = forecast_maps_error,
                                                       .texel_bytes = 8, /* depth and head */
                                                       .filters = true,
                                                       .has_lists = true,
                                                       .describe = describe,
                                                       .add_features = add_features,
                                                       .build = build,
                                                       .record = fill_record,
                                                       .bind = bind,
                                                       .report = report,
                                                       .drop = drop};

const struct shadow_method shadow_method_deep = {.id = SHADOWS_DEEP,
                                                 .structure = &shadow_structure_deep,
                                                 .reused = "shadow.deep",
                                                 .lookup = "deep",
                                                 .otherwise = &shadow_method_map,
                                                 .wants = shadow_wants_transparent};

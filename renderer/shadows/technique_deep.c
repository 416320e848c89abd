/* SPDX-License-Identifier: MIT */
/* `deep`: every transmittance event of a texel in one contiguous, sorted list (shadow_deep.h), and
 * on request its compression (shadow_compress.h). A light without a transparent caster has a plain
 * map. */
#include "renderer/gl/buffer_fill.h"
#include "renderer/shadows/shadow_compress.h"
#include "renderer/shadows/shadow_deep_job.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static bool wants(const struct shadow_casters *casters, const struct view_quality *quality)
{
    (void)quality;
    return casters->transparent_count > 0;
}

static void describe(struct shadow_map *map, const struct shadow_casters *casters,
                     const struct view_quality *quality, double allowed_error)
{
    if (casters->has_exclusions)
        map->flags |= SHADOW_FLAG_RAW;
    if (casters->has_media)
        map->flags |= SHADOW_FLAG_MEDIA;
    shadow_compress_choose(map, casters, quality, allowed_error);
}

static void add_features(struct shadow_features *features, const struct shadow_map *map)
{
    bool is_searched = !(map->flags & (SHADOW_FLAG_NODES | SHADOW_FLAG_RAW)); /* for an event */
    features->has[SHADOW_FEATURE_DEEP] = true;
    features->has[SHADOW_FEATURE_IDS] |= (map->flags & SHADOW_FLAG_RAW) != 0;
    features->has[SHADOW_FEATURE_MEDIA] |= (map->flags & SHADOW_FLAG_MEDIA) != 0;
    features->has[SHADOW_FEATURE_NODES] |= (map->flags & SHADOW_FLAG_NODES) != 0;
    features->has[SHADOW_FEATURE_SEARCHED] |= is_searched;
    features->has[SHADOW_FEATURE_LONG] |= is_searched && map->longest_list > SHADOW_SHORT_LIST;
}

/* Compressed lists are read before the exact ones of the next light take their memory. */
static bool build(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                  const struct shadow_scene *scene, const char *because, struct error *err)
{
    return shadow_deep_build(builder, builds, count, scene, because, err) &&
           shadow_compress_build(builder, builds, count, scene, because, err);
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

const struct shadow_method shadow_method_deep = {.id = SHADOWS_DEEP,
                                                 .scope = SHADOW_PER_LIGHT,
                                                 .passes = passes,
                                                 .otherwise = &shadow_method_map,
                                                 .wants = wants,
                                                 .kind = SHADOW_DEEP,
                                                 .reused = "shadow.deep",
                                                 .texel_bytes = 8, /* the depth and the head */
                                                 .has_lists = true,
                                                 .describe = describe,
                                                 .add_features = add_features,
                                                 .build = build};

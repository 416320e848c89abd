/* SPDX-License-Identifier: MIT */
/* `deep-linked`: lists that are sorted as their elements are inserted (shadow_deep.h). Lindbeck
 * 2015. A light without a transparent caster has a plain map, but for lists as published, whose
 * opaque casters are elements, too. */
#include "renderer/gl/buffer_fill.h"
#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static bool wants(const struct shadow_casters *casters, const struct view_quality *quality)
{
    return casters->transparent_count > 0 || (quality->faithful && casters->count > 0);
}

static void describe(struct shadow_map *map, const struct shadow_casters *casters,
                     const struct view_quality *quality, double allowed_error)
{
    (void)casters;
    (void)allowed_error;
    map->is_faithful = quality->faithful;
}

static void add_features(struct shadow_features *features, const struct shadow_map *map)
{
    features->has[SHADOW_FEATURE_LINKED] = true;
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

const struct shadow_method shadow_method_linked = {.id = SHADOWS_DEEP_LINKED,
                                                   .scope = SHADOW_PER_LIGHT,
                                                   .passes = passes,
                                                   .otherwise = &shadow_method_map,
                                                   .wants = wants,
                                                   .kind = SHADOW_LINKED,
                                                   .reused = "shadow.deep-linked",
                                                   .texel_bytes = 8, /* the depth and the head */
                                                   .has_lists = true,
                                                   .has_nodes = true,
                                                   .is_walked = true,
                                                   .follows_depths = true,
                                                   .describe = describe,
                                                   .add_features = add_features,
                                                   .build = shadow_linked_build};

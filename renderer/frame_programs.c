/* SPDX-License-Identifier: MIT */
/* Walking a plan for the programs of its passes, as frame_run.c walks it for their work. */
#include "renderer/frame_programs.h"

#include "renderer/shading/aov.h"
#include "renderer/shading/shade.h"
#include "renderer/shadows/shadow_programs.h"

static bool needs(const struct frame_programs_desc *desc, enum plan_need need)
{
    return desc->plan->plan.requirements[need].is_met;
}

/* What a listing goes by. */
struct listing {
    const struct frame_programs_desc *desc;
    struct targets targets; /* nothing is drawn to them */
    struct window_frame frame;
    struct shadow_programs_desc shadows;
    struct program_list *list;
};

static void listing_init(struct listing *listing, const struct frame_programs_desc *desc,
                         struct program_list *list)
{
    *listing = (struct listing){
        .desc = desc,
        .targets = {.samples = desc->plan->plan.target_samples},
        .frame = {.view = desc->view,
                  .state = desc->state,
                  .camera = desc->camera,
                  .limits = desc->limits,
                  .needs = &desc->plan->shaders},
        .shadows = {.needs = &desc->plan->shadows,
                    .gpu = desc->gpu,
                    .state = desc->state,
                    .quality = &desc->view->quality,
                    .resolution = shadow_resolution(&desc->view->quality, desc->limits),
                    .scans_on_host = desc->scans_on_host},
        .list = list,
    };
    listing->frame.targets = &listing->targets;
}

/* With layers, whether any of their fragments is seen decides between two programs. */
static void list_lookups(const struct listing *listing, const struct shadow_features *features,
                         bool may_surround, bool is_in_parts)
{
    char shadows[SHADOW_DEFINES_BYTES];
    shadow_features_write(features, shadows);
    const struct frame_programs_desc *desc = listing->desc;
    bool has_layers = needs(desc, PLAN_NEED_LAYERS);
    bool is_conditional = has_layers || features->has[SHADOW_FEATURE_SEARCHED];
    struct shade_facts facts = {
        .lists = light_lists_technique_defines(desc->view->quality.light_lists),
        .is_traced = needs(desc, PLAN_NEED_TRACED_SHADOWS),
        .has_media = desc->plan->items.medium_count > 0,
        .may_surround = may_surround,
    };
    facts.shadows = facts.is_traced ? SHADE_TRACED_SHADOWS : shadows;
    for (int has_entries = 0; has_entries <= has_layers; has_entries++) {
        facts.has_entries = has_entries;
        if (needs(desc, PLAN_NEED_COLOR))
            shade_list_programs(&listing->frame, &facts, is_in_parts, is_conditional,
                                listing->list);
        if (needs(desc, PLAN_NEED_AUXILIARY))
            aov_list_programs(&listing->frame, &facts, has_layers, listing->list);
    }
}

/* Where lists are searched, their lengths decide between two more. */
static void list_shading(const struct listing *listing, struct shadow_features features,
                         bool may_surround, bool is_in_parts)
{
    for (int is_long = 0; is_long <= features.has[SHADOW_FEATURE_SEARCHED]; is_long++) {
        features.has[SHADOW_FEATURE_LONG] = is_long;
        list_lookups(listing, &features, may_surround, is_in_parts);
    }
}

static void list_surfaces(const struct listing *listing, const struct geometry_items *items)
{
    const struct frame_programs_desc *desc = listing->desc;
    const struct view_quality *quality = &desc->view->quality;
    bool has_layers = needs(desc, PLAN_NEED_LAYERS);
    if (needs(desc, PLAN_NEED_SURFACES))
        geometry_list_opaque(&listing->frame, items, listing->list);
    if (has_layers)
        pixel_lists_list_programs(&listing->frame, items, listing->list);
    if (needs(desc, PLAN_NEED_LIGHTS))
        light_lists_list_programs(quality->light_lists, quality->faithful, listing->list);
    if (needs(desc, PLAN_NEED_TRACED_SHADOWS))
        traced_shadows_list_programs(&listing->frame, has_layers, listing->list);
}

bool frame_programs_list(const struct frame_programs_desc *desc, struct program_list *list,
                         struct error *err)
{
    struct listing listing;
    listing_init(&listing, desc, list);
    const struct shadow_features features = shadow_list_programs(&listing.shadows, list);
    list_surfaces(&listing, &desc->plan->items);
    list_shading(&listing, features, desc->plan->items.may_surround,
                 desc->plan->plan.least_batches > 1);
    return program_list_check(list, err);
}

/* For the features of the lights that are always seen and a choice, by its bits, of the others. */
static void list_choice(const struct listing *listing, const struct shadow_feature_sets *sets,
                        size_t choice)
{
    const struct frame_plan *plan = listing->desc->plan;
    struct shadow_features features = sets->always;
    for (size_t i = 0; i < sets->optional_count; i++)
        for (int k = 0; k < SHADOW_FEATURES; k++)
            features.has[k] |= choice >> i & 1 && sets->optional[i].has[k];
    for (int surrounds = 0; surrounds <= (plan->items.medium_count > 0); surrounds++)
        for (int in_parts = 0; in_parts <= (plan->plan.least_batches > 1); in_parts++)
            list_shading(listing, features, surrounds, in_parts);
}

bool frame_programs_list_all(const struct frame_programs_desc *desc, struct program_list *list,
                             struct error *err)
{
    struct listing listing;
    struct geometry_items items = desc->plan->items;
    items.may_surround = items.medium_count > 0;
    listing_init(&listing, desc, list);
    const struct shadow_features features = shadow_list_programs(&listing.shadows, list);
    list_surfaces(&listing, &items);
    const struct shadow_feature_sets sets = shadow_list_features(&listing.shadows);
    for (size_t choice = 0; choice < (size_t)1 << sets.optional_count; choice++)
        list_choice(&listing, &sets, choice);
    if (sets.has_more) /* and all of one frame */
        list_shading(&listing, features, desc->plan->items.may_surround, false);
    return program_list_check(list, err);
}

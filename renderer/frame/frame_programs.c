/* SPDX-License-Identifier: MIT */
/* Walking a plan for the programs of its passes, as frame_run.c walks it for their work. */
#include "renderer/frame/frame_programs.h"

#include "renderer/shading/accumulation.h"
#include "renderer/shading/aov.h"
#include "renderer/shading/deep.h"
#include "renderer/shading/refraction.h"
#include "renderer/shading/screen.h"
#include "renderer/shading/shade.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/technique.h"
#include "renderer/window/apart.h"

static bool needs(const struct frame_programs_desc *desc, enum plan_need need)
{
    return desc->plan->plan.requirements[need].is_met;
}

/* The state of a listing. */
struct listing {
    const struct frame_programs_desc *desc;
    struct targets targets; /* nothing is drawn to them */
    struct window_frame frame;
    struct shadow_programs_desc shadows;
    bool is_traced; /* shadows by rays */
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
                  .needs = &desc->plan->shaders,
                  .has_glow = desc->plan->plan.has_glow,
                  .rounds = desc->plan->plan.rounds,
                  .depths.most_bytes = desc->depths_bytes},
        .shadows = {.needs = &desc->plan->shadows,
                    .gpu = desc->gpu,
                    .state = desc->state,
                    .quality = &desc->view->quality,
                    .resolution = shadow_resolution(&desc->view->quality, desc->limits),
                    .ways = desc->shadow_ways},
        .is_traced = needs(desc, PLAN_NEED_TRACED_SHADOWS),
        .list = list,
    };
    listing->frame.targets = &listing->targets;
}

/* How the lights of a window come to it. */
struct lit_parts {
    bool may[LIGHT_PARTS];
    int count;   /* of these */
    bool differ; /* batches, in the features of their structures */
};

static struct lit_parts parts_of(const struct listing *listing, bool is_in_batches)
{
    const struct frame_programs_desc *desc = listing->desc;
    const struct plan *plan = &desc->plan->plan;
    struct lit_parts parts = {.count = 0};
    parts.count = light_parts_list(
        &(struct light_parts_desc){.frame = &listing->frame,
                                   .loop_steps = desc->loop_steps,
                                   .shadowed_count = plan_shadowed_lights(plan),
                                   .is_traced = needs(desc, PLAN_NEED_TRACED_SHADOWS),
                                   .is_in_batches = is_in_batches,
                                   .has_layers = needs(desc, PLAN_NEED_LAYERS)},
        parts.may);
    return parts;
}

/* Where there may be layers, whether any is in view decides between two programs. */
static void list_lookups(const struct listing *listing, const struct shadow_features *features,
                         bool may_surround, const struct lit_parts *parts)
{
    char shadows[SHADOW_DEFINES_BYTES];
    shadow_features_write(features, shadows);
    const struct frame_programs_desc *desc = listing->desc;
    bool may_have_layers = needs(desc, PLAN_NEED_LAYERS);
    bool is_conditional = may_have_layers || features->has[SHADOW_FEATURE_SEARCHED] ||
                          parts->count > 1 || parts->differ;
    struct shade_facts facts = {
        .lists = light_lists_technique_defines(desc->view->quality.light_lists),
        .method = desc->plan->plan.transparency,
        .is_traced = listing->is_traced,
        .has_media = desc->plan->items.medium_count > 0,
        .may_surround = may_surround,
    };
    facts.shadows = facts.is_traced ? SHADE_TRACED_SHADOWS : shadows;
    for (int has_layers = 0; has_layers <= may_have_layers; has_layers++) {
        facts.has_layers = has_layers;
        for (int i = 0; i < LIGHT_PARTS && needs(desc, PLAN_NEED_COLOR); i++)
            if (parts->may[i])
                shade_list_programs(&listing->frame, &facts, (enum light_parts)i, is_conditional,
                                    listing->list);
        if (needs(desc, PLAN_NEED_DEEP))
            deep_list_programs(&listing->frame, &facts, may_have_layers, listing->list);
        if (needs(desc, PLAN_NEED_AUXILIARY))
            aov_list_programs(&listing->frame, &facts, may_have_layers, listing->list);
    }
}

/* Where lists are searched, their lengths decide between two more. */
static void list_shading(const struct listing *listing, struct shadow_features features,
                         bool may_surround, const struct lit_parts *parts)
{
    for (int is_long = 0; is_long <= features.has[SHADOW_FEATURE_SEARCHED]; is_long++) {
        features.has[SHADOW_FEATURE_LONG] = is_long;
        list_lookups(listing, &features, may_surround, parts);
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
        desc->plan->plan.transparency->list_programs(&listing->frame, items, listing->list);
    if (needs(desc, PLAN_NEED_LIGHTS))
        light_lists_list_programs(quality->light_lists, quality->faithful,
                                  listing->frame.limits->is_software, listing->list);
    if (needs(desc, PLAN_NEED_TRACED_SHADOWS) || needs(desc, PLAN_NEED_VISIBILITY))
        traced_shadows_list_programs(
            &listing->frame, has_layers ? desc->plan->plan.transparency->surfaces : NULL,
            shadow_finder_of(desc->plan->plan.window_shadows), listing->list);
    if (needs(desc, PLAN_NEED_COLOR))
        apart_list_programs(&listing->frame, listing->list);
    if (needs(desc, PLAN_NEED_REFRACTION))
        refraction_list_programs(&listing->frame, listing->list);
    accumulation_list_programs(&listing->frame, listing->list);
    if (desc->view->screen.channels)
        screen_list_programs(listing->list);
}

/* The features of the lights that every choice has, and of those others whose bits are set. */
static struct shadow_features choose(const struct shadow_feature_sets *sets, size_t choice)
{
    struct shadow_features features = sets->always;
    for (size_t i = 0; i < sets->optional_count; i++)
        if (choice >> i & 1)
            shadow_features_join(&features, &sets->optional[i]);
    return features;
}

/* Each has a structure at least. */
static void list_batches(const struct listing *listing, bool may_surround)
{
    const struct shadow_feature_sets sets = shadow_list_batch_features(&listing->shadows);
    struct lit_parts parts = parts_of(listing, true);
    parts.differ = sets.optional_count > 1 || sets.has_more;
    for (size_t choice = !sets.has_more; choice < (size_t)1 << sets.optional_count; choice++)
        list_shading(listing, choose(&sets, choice), may_surround, &parts);
}

bool frame_programs_list(const struct frame_programs_desc *desc, struct program_list *list,
                         struct error *err)
{
    struct listing listing;
    listing_init(&listing, desc, list);
    bool may_surround = desc->plan->items.may_surround;
    const struct shadow_features features = shadow_list_programs(&listing.shadows, list);
    const struct lit_parts parts = parts_of(&listing, false);
    list_surfaces(&listing, &desc->plan->items);
    if (desc->is_in_batches || desc->plan->plan.least_batches > 1)
        list_batches(&listing, may_surround);
    else
        list_shading(&listing, features, may_surround, &parts);
    return program_list_check(list, err);
}

/* Lists the programs of pictures that no light reaches, with and without drawables. */
static void list_dark(struct listing *listing)
{
    char shadows[SHADOW_DEFINES_BYTES];
    const struct shadow_features none = {.has = {false}};
    if (listing->is_traced) {
        listing->is_traced = false;
        list_shading(listing, none, listing->desc->plan->items.medium_count > 0,
                     &(struct lit_parts){.may = {[LIGHTS_AT_ONCE] = true}, .count = 1});
    }
    const struct shade_facts facts = {
        .lists = light_lists_technique_defines(listing->desc->view->quality.light_lists),
        .shadows = shadows,
    };
    shadow_features_write(&none, shadows);
    if (needs(listing->desc, PLAN_NEED_COLOR))
        shade_list_programs(&listing->frame, &facts, LIGHTS_AT_ONCE, true, listing->list);
    if (needs(listing->desc, PLAN_NEED_DEEP))
        deep_list_programs(&listing->frame, &facts, false, listing->list);
    if (needs(listing->desc, PLAN_NEED_AUXILIARY))
        aov_list_programs(&listing->frame, &facts, false, listing->list);
}

/* Lists what any frame may draw that has, or has not, listing->frame.has_glow. */
static void list_frames(struct listing *listing, const struct shadow_features *features)
{
    const struct frame_programs_desc *desc = listing->desc;
    struct geometry_items items = desc->plan->items;
    bool has_media = items.medium_count > 0;
    items.may_surround = has_media;
    const struct lit_parts parts = parts_of(listing, false);
    list_surfaces(listing, &items);
    const struct shadow_feature_sets sets = shadow_list_features(&listing->shadows);
    for (int surrounds = 0; surrounds <= has_media; surrounds++) {
        for (size_t choice = 0; choice < (size_t)1 << sets.optional_count; choice++)
            list_shading(listing, choose(&sets, choice), surrounds, &parts);
        if (desc->is_in_batches || desc->plan->plan.least_batches > 1)
            list_batches(listing, surrounds);
    }
    if (sets.has_more) /* and all of one frame */
        list_shading(listing, *features, desc->plan->items.may_surround, &parts);
    list_dark(listing);
}

/* Where a camera sees no lamp in the haze, a picture over a backdrop is mapped at once. */
bool frame_programs_list_all(const struct frame_programs_desc *desc, struct program_list *list,
                             struct error *err)
{
    struct listing listing;
    listing_init(&listing, desc, list);
    listing.frame.depths.is_anywhere = true;
    const struct shadow_features features = shadow_list_programs(&listing.shadows, list);
    bool may_differ = listing.frame.has_glow && desc->view->screen.has_backdrop;
    list_frames(&listing, &features);
    listing.frame.has_glow = false;
    listing.is_traced = needs(desc, PLAN_NEED_TRACED_SHADOWS);
    if (may_differ)
        list_frames(&listing, &features);
    return program_list_check(list, err);
}

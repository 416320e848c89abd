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

/* With layers, whether any of their fragments is seen decides between two programs. */
static void list_shading(const struct frame_programs_desc *desc, const struct window_frame *frame,
                         const char *shadows, struct program_list *list)
{
    const struct geometry_items *items = &desc->plan->items;
    bool has_layers = needs(desc, PLAN_NEED_LAYERS);
    bool is_in_parts = desc->plan->plan.least_batches > 1;
    struct shade_facts facts = {
        .lists = light_lists_technique_defines(desc->view->quality.light_lists),
        .is_traced = needs(desc, PLAN_NEED_TRACED_SHADOWS),
        .has_media = items->medium_count > 0,
        .may_surround = items->may_surround,
    };
    facts.shadows = facts.is_traced ? SHADE_TRACED_SHADOWS : shadows;
    for (int has_entries = 0; has_entries <= has_layers; has_entries++) {
        facts.has_entries = has_entries;
        if (needs(desc, PLAN_NEED_COLOR))
            shade_list_programs(frame, &facts, is_in_parts, has_layers, list);
        if (needs(desc, PLAN_NEED_AUXILIARY))
            aov_list_programs(frame, &facts, has_layers, list);
    }
}

bool frame_programs_list(const struct frame_programs_desc *desc, struct program_list *list,
                         struct error *err)
{
    const struct frame_plan *plan = desc->plan;
    const struct view_quality *quality = &desc->view->quality;
    struct targets targets = {.samples = plan->plan.target_samples}; /* nothing is drawn to them */
    const struct window_frame frame = {.view = desc->view,
                                       .state = desc->state,
                                       .camera = desc->camera,
                                       .limits = desc->limits,
                                       .needs = &plan->shaders,
                                       .targets = &targets};
    const struct shadow_programs_desc shadows = {
        .needs = &plan->shadows,
        .gpu = desc->gpu,
        .state = desc->state,
        .quality = quality,
        .resolution = shadow_resolution(quality, desc->limits),
        .scans_on_host = desc->scans_on_host,
    };
    char defines[SHADOW_DEFINES_BYTES];
    shadow_list_programs(&shadows, defines, list);
    if (needs(desc, PLAN_NEED_SURFACES))
        geometry_list_opaque(&frame, &plan->items, list);
    if (needs(desc, PLAN_NEED_LAYERS))
        pixel_lists_list_programs(&frame, &plan->items, list);
    if (needs(desc, PLAN_NEED_LIGHTS))
        light_lists_list_programs(quality->light_lists, quality->faithful, list);
    if (needs(desc, PLAN_NEED_TRACED_SHADOWS))
        traced_shadows_list_programs(&frame, needs(desc, PLAN_NEED_LAYERS), list);
    list_shading(desc, &frame, defines, list);
    return program_list_check(list, err);
}

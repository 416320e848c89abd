/* SPDX-License-Identifier: MIT */
/* `volume`: shadow volumes of transparent and opaque casters, for every surface and layer of a
 * window (finder_volume.c). `silhouette`: the same volumes, whose faces count whole casters of each
 * filter. */
#include "renderer/shadows/caster_filter.h"
#include "renderer/shadows/shadow_finder.h"
#include "renderer/shadows/technique.h"

static bool fits(const struct scene_state *state, const struct state_item *item,
                 const struct view_quality *quality)
{
    return caster_filter_is_even(state, item, quality->blend_filter) &&
           !state->materials[item->material].no_self_shadow;
}

static const struct shadow_pass passes[] = {
    {.name = "shadow.edges"},
    {.name = "shadow.points", .is_of_windows = true},
    {.name = "shadow.volumes", .is_of_windows = true},
    {.name = NULL},
};

static const struct shadow_trial trials[] = {
    {"volume", {.shadows = SHADOWS_VOLUME}},
    {.name = NULL},
};

static const struct shadow_trial silhouette_trials[] = {
    {"silhouette", {.shadows = SHADOWS_SILHOUETTE}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_volume = {
    .scope = SHADOW_PER_WINDOW,
    .passes = passes,
    .trials = trials,
    .forecast = forecast_add_volumes,
    .finder = &shadow_finder_volume,
};

const struct shadow_method shadow_method_volume = {.id = SHADOWS_VOLUME,
                                                   .structure = &shadow_structure_volume,
                                                   .wants = shadow_wants_any,
                                                   .fits = fits,
                                                   .instead = &shadow_method_rays};

const struct shadow_structure shadow_structure_silhouette = {
    .scope = SHADOW_PER_WINDOW,
    .passes = passes,
    .trials = silhouette_trials,
    .forecast = forecast_add_volumes,
    .finder = &shadow_finder_silhouette,
};

const struct shadow_method shadow_method_silhouette = {.id = SHADOWS_SILHOUETTE,
                                                       .structure = &shadow_structure_silhouette,
                                                       .wants = shadow_wants_any,
                                                       .fits = fits,
                                                       .instead = &shadow_method_rays};

/* SPDX-License-Identifier: MIT */
/* `volume`: shadow volumes of transparent and opaque casters, for every surface and layer of a
 * window (finder_volume.c); `faithful`: blended into half floats, as published, for the surface
 * and the nearest layer of each pixel (volume_drawing.h). `silhouette`: the same volumes, whose
 * faces count whole casters of each filter. */
#include "renderer/gl/context.h"
#include "renderer/shadows/caster_filter.h"
#include "renderer/shadows/shadow_finder.h"
#include "renderer/shadows/technique.h"
#include "renderer/shadows/volume_casters.h"

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
    .least_gain = 0.5,
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
    .least_gain = 0.5,
    .finder = &shadow_finder_silhouette,
};

/* Stages before that of fragments read what they draw from storage blocks, of which a device may
 * give them none. */
static bool check_blocks(enum view_silhouette_form form, const struct gl_limits *limits,
                         struct error *err)
{
    enum { BLOCKS = 8 }; /* of shaders/shadows/volume_quads.glsl */
    bool has_geometry =
        form != VIEW_SILHOUETTE_COMPUTE && form != VIEW_SILHOUETTE_TRIANGLES_ONE_PASS;
    bool is_tessellated = form == VIEW_SILHOUETTE_TESSELLATION ||
                          form == VIEW_SILHOUETTE_TRIANGLES_TWO_PASS ||
                          form == VIEW_SILHOUETTE_TRIANGLES_ONE_PASS;
    if ((!has_geometry || limits->max_geometry_blocks >= BLOCKS) &&
        (!is_tessellated || limits->max_tessellation_blocks >= BLOCKS))
        return true;
    return error_set(err, ERROR_UNSUPPORTED,
                     "silhouettes take %d storage blocks, and this device gives geometry programs "
                     "%d and tessellation %d: silhouette_form must be compute",
                     (int)BLOCKS, limits->max_geometry_blocks, limits->max_tessellation_blocks);
}

static size_t count_groups(const struct scene_state *state, const struct view_quality *quality)
{
    struct volume_weight groups[VOLUME_GROUPS_MOST];
    return volume_groups_find(state, quality->blend_filter, groups);
}

static bool check_silhouette(const struct scene_state *state, const struct view_quality *quality,
                             const struct gl_limits *limits, struct error *err)
{
    enum view_silhouette_form form = quality->silhouette_form;
    return form == VIEW_SILHOUETTE_COMPUTE ||
           (check_blocks(form, limits, err) &&
            volume_groups_check(count_groups(state, quality), form, err));
}

static const char *fall_back(const struct scene_state *state, const struct view_quality *quality)
{
    _Static_assert(VOLUME_GROUPS_MOST == 24, "the warning says so");
    return count_groups(state, quality) > VOLUME_GROUPS_MOST
               ? "silhouette counts casters of up to 24 filters, and the scene has more: "
                 "logarithms of their filters are added in place of counts, as volume does"
               : NULL;
}

const struct shadow_method shadow_method_silhouette = {.id = SHADOWS_SILHOUETTE,
                                                       .structure = &shadow_structure_silhouette,
                                                       .wants = shadow_wants_any,
                                                       .fits = fits,
                                                       .instead = &shadow_method_rays,
                                                       .check = check_silhouette,
                                                       .fall_back = fall_back};

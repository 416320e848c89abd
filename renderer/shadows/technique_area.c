/* SPDX-License-Identifier: MIT */
/* `area`: the triangles that may block a light are rasterised onto its samples at every point of a
 * window, on the device (area_grid.h). */
#include "renderer/shadows/caster_filter.h"
#include "renderer/shadows/shadow_finder.h"
#include "renderer/shadows/technique.h"

static bool fits(const struct scene_state *state, const struct state_item *item,
                 const struct view_quality *quality)
{
    return caster_filter_is_even(state, item, quality->blend_filter);
}

static const struct shadow_pass passes[] = {
    {.name = "shadow.casters"},
    {.name = "shadow.points", .is_of_windows = true},
    {.name = "shadow.area", .is_of_windows = true},
    {.name = NULL},
};

static const struct shadow_trial trials[] = {
    {"area", {.shadows = SHADOWS_AREA}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_area = {
    .scope = SHADOW_PER_WINDOW,
    .passes = passes,
    .trials = trials,
    .forecast = forecast_add_area,
    .least_gain = 0.5,
    .sure_triangles = 65000, /* those of a cell are gone through in one loop */
    .finder = &shadow_finder_area,
};

const struct shadow_method shadow_method_area = {.id = SHADOWS_AREA,
                                                 .structure = &shadow_structure_area,
                                                 .wants = shadow_wants_any,
                                                 .fits = fits,
                                                 .instead = &shadow_method_rays};

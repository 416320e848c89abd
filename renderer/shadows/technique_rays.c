/* SPDX-License-Identifier: MIT */
/* `raytraced-shadows`: rays on the processor find the shadow of every surface and layer of a window
 * (shadow_traced.h). */
#include "renderer/shadows/shadow_finder.h"
#include "renderer/shadows/technique.h"

static const struct shadow_pass passes[] = {
    {.name = "raytrace.build"},
    {.name = "shadow.points", .is_of_windows = true},
    {.name = "shadow.trace", .is_of_windows = true},
    {.name = NULL},
};

static const struct shadow_trial trials[] = {
    {"raytraced-shadows", {.shadows = SHADOWS_RAYTRACED_SHADOWS}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_rays = {
    .scope = SHADOW_PER_WINDOW,
    .passes = passes,
    .trials = trials,
    .forecast = forecast_add_points,
    .finder = &shadow_finder_rays,
};

const struct shadow_method shadow_method_rays = {.id = SHADOWS_RAYTRACED_SHADOWS,
                                                 .structure = &shadow_structure_rays,
                                                 .wants = shadow_wants_any};

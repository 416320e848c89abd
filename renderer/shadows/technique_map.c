/* SPDX-License-Identifier: MIT */
/* `map`: the depth of the nearest opaque caster of each texel. Williams 1978, "Casting Curved
 * Shadows on Curved Surfaces". Transparent casters cast none. */
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static bool wants(const struct shadow_casters *casters, const struct view_quality *quality)
{
    (void)quality;
    return casters->opaque_count > 0;
}

static const struct shadow_pass passes[] = {{.name = NULL}}; /* the depth is all */

static const struct shadow_trial trials[] = {
    {"map", {.shadows = SHADOWS_MAP}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_map = {.scope = SHADOW_PER_LIGHT,
                                                      .passes = passes,
                                                      .trials = trials,
                                                      .forecast = forecast_add_maps,
                                                      .forecast_error = forecast_maps_error,
                                                      .texel_bytes = 4};

const struct shadow_method shadow_method_map = {
    .id = SHADOWS_MAP, .structure = &shadow_structure_map, .reused = "shadow.map", .wants = wants};

/* SPDX-License-Identifier: MIT */
/* `translucent`: of each texel the nearest transparent depth and the product of all filters before
 * the opaque one. Filion and McNaughton 2008, "StarCraft II: Effects & techniques" (Advances in
 * Real-Time Rendering, SIGGRAPH), "Translucent shadows", as Modisett 2023 describes it. Filters are
 * multiplied, which needs no order, where the source blends surface colours from the nearest on;
 * with `faithful` they are blended so, each one's colour over the share that it lets through.
 * Whatever lies behind the nearest transparent surface gets the light behind all of them. */
#include "renderer/shadows/shadow_texels.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static const struct shadow_pass passes[] = {
    {.name = "shadow.translucent",
     .casters = {CASTER_PRODUCT, CASTER_BLEND},
     .list_programs = shadow_texels_list_programs},
    {.name = NULL},
};

static const struct shadow_trial trials[] = {
    {"translucent", {.shadows = SHADOWS_TRANSLUCENT}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_translucent = {SHADOW_TEXELS_STRUCTURE,
                                                              .describe = shadow_texels_describe,
                                                              .passes = passes, .trials = trials};

const struct shadow_method shadow_method_translucent = {.id = SHADOWS_TRANSLUCENT,
                                                        .structure = &shadow_structure_translucent,
                                                        .reused = "shadow.translucent",
                                                        .lookup = "translucent",
                                                        .otherwise = &shadow_method_map,
                                                        .wants = shadow_wants_transparent};

/* SPDX-License-Identifier: MIT */
/* `stochastic`: of each texel four depths, which a transparent caster takes with the chance of its
 * opacity. Enderton, Sintorn, Shirley and Luebke 2010, "Stochastic transparency" (I3D): its
 * stochastic shadow maps, with stratified samples within a texel; `faithful`: with one, not
 * stratified, as in the code that goes with Modisett 2023. Opaque casters stand in the depth map.
 * Noise is a function of the light, the texel and the triangle, so it stands still
 * (shadow_noise.glsl). */
#include "renderer/shadows/shadow_texels.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static const struct shadow_pass passes[] = {
    {.name = "shadow.stochastic",
     .casters = {CASTER_CHANCE, CASTER_ONE_CHANCE},
     .list_programs = shadow_texels_list_programs},
    {.name = NULL},
};

static const struct shadow_trial trials[] = {
    {"stochastic", {.shadows = SHADOWS_STOCHASTIC}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_stochastic = {
    SHADOW_TEXELS_STRUCTURE, .describe = shadow_texels_describe, .passes = passes, .trials = trials,
    .noise = 0.6};

const struct shadow_method shadow_method_stochastic = {.id = SHADOWS_STOCHASTIC,
                                                       .structure = &shadow_structure_stochastic,
                                                       .reused = "shadow.stochastic",
                                                       .lookup = "stochastic",
                                                       .otherwise = &shadow_method_map,
                                                       .wants = shadow_wants_transparent};

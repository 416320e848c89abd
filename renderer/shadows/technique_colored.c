/* SPDX-License-Identifier: MIT */
/* `colored-stochastic`: of each texel a depth for red, green and blue, which a transparent caster
 * takes with the chance that it stops light of that colour. McGuire and Enderton 2011, "Colored
 * stochastic shadow maps" (I3D): the second form, CSSM2, whose three depths are blended by their
 * minimum. Opaque casters stand in the depth map. Noise is that of `stochastic`. `faithful`: the
 * first form, CSSM1, in which the casters are drawn once for each wavelength into a stochastic
 * shadow map of its own, with one sample of each texel, not stratified. */
#include "renderer/shadows/shadow_texels.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static const struct shadow_pass passes[] = {
    {.name = "shadow.colored-stochastic",
     .casters = {CASTER_COLOR_CHANCE, CASTER_WAVELENGTH},
     .list_programs = shadow_texels_list_programs},
    {.name = NULL},
};

static const struct shadow_trial trials[] = {
    {"colored-stochastic", {.shadows = SHADOWS_COLORED_STOCHASTIC}},
    {"colored-stochastic, faithful", {.shadows = SHADOWS_COLORED_STOCHASTIC, .faithful = true}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_colored = {
    SHADOW_TEXELS_STRUCTURE, .describe = shadow_texels_describe, .passes = passes, .trials = trials,
    .noise = 0.6};

const struct shadow_method shadow_method_colored = {.id = SHADOWS_COLORED_STOCHASTIC,
                                                    .structure = &shadow_structure_colored,
                                                    .reused = "shadow.colored-stochastic",
                                                    .lookup = "colored",
                                                    .otherwise = &shadow_method_map,
                                                    .wants = shadow_wants_transparent};

// SPDX-License-Identifier: MIT
// Lookups in coloured stochastic shadow maps (McGuire and Enderton 2011): a colour passes where the
// receiver is not behind its depth. Provides: shadow_run_colored, shadow_list_colored
// (shadow_lists.glsl)
#include "shadows/shadow_texel.glsl"

bool shadow_run_colored(uint flags, uint head, uint event_base, out shadow_run run)
{
    run = shadow_run(int(head), 0);
    return shadow_texel(run).a < SHADOW_TEXEL_FAR;
}

vec3 shadow_list_colored(shadow_run run, shadow_look look)
{
    return vec3(lessThanEqual(vec3(look.depth), shadow_texel(run).rgb));
}

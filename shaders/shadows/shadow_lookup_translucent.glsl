// SPDX-License-Identifier: MIT
// Lookups in translucent shadow maps (Filion and McNaughton 2008; Modisett 2023, 2.1.3): rgb is the
// product of all filters of the texel, alpha the nearest depth of one. Compared tap by tap, where
// the sources blend by the share of taps that are behind the nearest depth.
// Provides: shadow_run_translucent, shadow_list_translucent (shadow_lists.glsl)
#include "shadows/shadow_texel.glsl"

bool shadow_run_translucent(uint flags, uint head, uint event_base, out shadow_run run)
{
    run = shadow_run(int(head), 0);
    return shadow_texel(run).a < SHADOW_TEXEL_FAR;
}

vec3 shadow_list_translucent(shadow_run run, shadow_look look)
{
    vec4 texel = shadow_texel(run);
    return look.depth > texel.a ? texel.rgb : vec3(1.0);
}

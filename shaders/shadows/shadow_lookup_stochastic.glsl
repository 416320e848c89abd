// SPDX-License-Identifier: MIT
// Lookups in stochastic shadow maps (Enderton et al. 2010): the share of four depths that the
// receiver is not behind. Provides: shadow_run_stochastic, shadow_list_stochastic
// (shadow_lists.glsl)
#include "shadows/shadow_texel.glsl"

bool shadow_run_stochastic(uint flags, uint head, uint event_base, out shadow_run run)
{
    run = shadow_run(int(head), 0);
    return any(lessThan(shadow_texel(run), vec4(SHADOW_TEXEL_FAR)));
}

vec3 shadow_list_stochastic(shadow_run run, shadow_look look)
{
    bvec4 passes = lessThanEqual(vec4(look.depth), shadow_texel(run));
    return vec3(dot(vec4(passes), vec4(0.25)));
}

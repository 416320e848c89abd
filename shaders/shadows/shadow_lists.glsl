// SPDX-License-Identifier: MIT
// The product of the transmittance events of one texel before a depth, from whichever technique's
// lists the texel has. SHADOW_LISTS has an item NAME:ID for each technique with lists in the frame,
// whose lookups stand in shadow_lookup_NAME.glsl. That file provides:
//   bool shadow_run_NAME(uint flags, uint head, uint event_base, out shadow_run run)
//     the list of the texel that has this head; false: nothing of it filters light
//   vec3 shadow_list_NAME(shadow_run run, shadow_look look)
#include "shadows/shadow_run.glsl"
#each SHADOW_LISTS #include "shadows/shadow_lookup_$1.glsl"

bool shadow_run_read(uint technique, uint flags, uint head, uint event_base, out shadow_run run)
{
#each SHADOW_LISTS if (technique == $2u) return shadow_run_$1(flags, head, event_base, run);
    run = shadow_run(0, 0);
    return false;
}

vec3 shadow_list(uint technique, shadow_run run, shadow_look look)
{
#each SHADOW_LISTS if (technique == $2u) return shadow_list_$1(run, look);
    return vec3(1.0);
}

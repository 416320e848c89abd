// SPDX-License-Identifier: MIT
// Four floats of each texel, by techniques without lists (shadow_texel.frag.glsl); texels without a
// transparent caster have the depth SHADOW_TEXEL_FAR. Such a run begins at the texel.
#include "shadows/shadow_run.glsl"
layout(binding = UNIT_SHADOW_TEXELS) uniform samplerBuffer u_shadow_texels;

vec4 shadow_texel(shadow_run run)
{
    return texelFetch(u_shadow_texels, run.begin);
}

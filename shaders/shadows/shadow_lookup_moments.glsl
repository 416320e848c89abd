// SPDX-License-Identifier: MIT
// Lookups in maps of moments: of each texel four moments of the absorbance over depth for each
// colour, what all casters absorb, and the depth of the farthest (base/moments.glsl;
// renderer/shadows/technique_moments.c). Behind the farthest the light is exact, between two depths
// as well. A table in the heads has the texels of a part, the nearest depth and the depths per
// metre. Provides: shadow_run_moments, shadow_list_moments (shadow_lists.glsl)
#include "base/moments.glsl"
#include "shadows/shadow_texel.glsl"

// Of what may be at the depth itself, the share that dims the light. Over stacks of three to
// sixteen random panes this is the one that is off least between panes.
const float MOMENT_SHARE = 0.4;
// A caster is asked about a little before its own depth, where the bias of the moments does not
// take it for what is in front; there a quarter, the authors' choice, is off least.
const float MOMENT_BEFORE = 0.02, MOMENT_SHARE_BEFORE = 0.25;

bool shadow_run_moments(uint flags, uint head, uint event_base, out shadow_run run)
{
    int part = int(texelFetch(u_shadow_heads, int(event_base)).r);
    run = shadow_run(int(head), int(head) + int(SHADOW_PART_TOTAL) * part); // its end: the total
    return texelFetch(u_shadow_texels, run.end).a > 0.0;
}

vec3 shadow_list_moments(shadow_run run, shadow_look look)
{
    int table = int(look.event_base), part = int(texelFetch(u_shadow_heads, table).r);
    float nearest = uintBitsToFloat(texelFetch(u_shadow_heads, table + 1).r);
    float depths_per_m = uintBitsToFloat(texelFetch(u_shadow_heads, table + 2).r);
    float z = (look.depth - nearest) * depths_per_m - 1.0;
    vec4 total = texelFetch(u_shadow_texels, run.end);
    if (z + 2.0 > total.a)
        return exp(-total.rgb);
    float share = MOMENT_SHARE;
    if (look.object != NO_OBJECT) {
        z -= MOMENT_BEFORE;
        share = MOMENT_SHARE_BEFORE;
    }
    if (z <= -1.0)
        return vec3(1.0);
    vec4 r = texelFetch(u_shadow_texels, run.begin);
    vec4 g = texelFetch(u_shadow_texels, run.begin + part);
    vec4 b = texelFetch(u_shadow_texels, run.begin + 2 * part);
    moments m = moments_normalize(moments(total.rgb, vec3(r.x, g.x, b.x), vec3(r.y, g.y, b.y),
                                          vec3(r.z, g.z, b.z), vec3(r.w, g.w, b.w)));
    vec3 front, at;
    masses_at(m, z, front, at);
    return exp(-m.m0 * (front + share * at));
}

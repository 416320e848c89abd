// SPDX-License-Identifier: MIT
// Lookups in composited translucent shadow maps (Modisett 2023, 5.1): of each partition of the
// transparent meshes a layer of texels, the product of all filters that are nearer to the light and
// the nearest depth of one. A table in the heads has where the layer of each node begins
// (renderer/shadows/technique_composited.c). Provides: shadow_run_composited,
// shadow_list_composited (shadow_lists.glsl)
#include "shadows/shadow_texel.glsl"

bool shadow_run_composited(uint flags, uint head, uint event_base, out shadow_run run)
{
    run = shadow_run(int(head), 0);
    return shadow_texel(run).a < SHADOW_TEXEL_FAR; // of layer 0, which has all casters
}

vec3 shadow_list_composited(shadow_run run, shadow_look look)
{
    int table = int(look.event_base);
    uint layer = 0u;
    if (look.object < texelFetch(u_shadow_heads, table).r)
        layer = texelFetch(u_shadow_heads, table + 1 + int(look.object)).r;
    if (layer == SHADOW_ALL_LIT)
        return vec3(1.0);
    run.begin += int(layer);
    vec4 texel = shadow_texel(run);
    return look.depth > texel.a ? texel.rgb : vec3(1.0);
}

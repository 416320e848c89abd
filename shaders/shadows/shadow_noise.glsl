// SPDX-License-Identifier: MIT
// Numbers in [0, 1) for what is left to chance: of a texel, a triangle and a channel always the
// same ones, so that noise stands still from frame to frame and has the same bits everywhere. The
// triangles of a ray are independent of each other, also where their coordinates are equal; the
// numbers of one triangle are stratified over tiles of 4 x 4 texels.
// Provides: vec4 shadow_noise(uvec2 at, uint samples); float shadow_noise_alone(uvec2 at, uint
// channel), one number, not stratified. Needs FACE, v_draw, v_primitive.

#include "base/hash_words.glsl"

uvec4 shadow_noise_words(uint place)
{
    return pcg4d(uvec4(place, v_draw.y ^ FACE.seed, v_primitive, uint(gl_PrimitiveID)));
}

// Strata of a number among the texels of a tile, and the `samples` of each, in an order that hangs
// on the word: every stratum has one.
uvec4 shadow_noise_strata(uvec4 index, uvec4 word, uint count)
{
    uint mask = count - 1u;
    uvec4 order = index * (word << 1u | 1u) + (word >> 8u);
    return (order & mask) ^ (word >> 16u & mask);
}

float shadow_noise_alone(uvec2 at, uint channel)
{
    return float(shadow_noise_words(at.x | at.y << 15u)[channel] >> 8u) / 16777216.0;
}

// samples 1: the channels are numbers of their own; 4: four samples of one.
vec4 shadow_noise(uvec2 at, uint samples)
{
    uvec2 tile = at >> 2u, within = at & 3u;
    uint texel = within.y * 4u + within.x;
    uvec4 order = shadow_noise_words(tile.x | tile.y << 16u | 0x80000000u);
    uvec4 within_stratum = shadow_noise_words(at.x | at.y << 15u);
    bool is_one = samples == 4u;
    uvec4 index = is_one ? texel * 4u + uvec4(0u, 1u, 2u, 3u) : uvec4(texel);
    uint count = 16u * samples;
    uvec4 stratum = shadow_noise_strata(index, is_one ? order.xxxx : order, count);
    // 16 bits, so that no sum is rounded up to the next stratum
    vec4 rest = vec4(within_stratum >> 16u) / 65536.0;
    return (vec4(stratum) + rest) / float(count);
}

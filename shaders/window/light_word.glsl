// SPDX-License-Identifier: MIT
// Light in a word: the logarithm of each channel in ten bits, so that contrast is a difference.
// Provides: light_word, light_words_differ.
#include "shared/contrast.h"
#define LIGHT_MIXED 0x80000000u // in that of a pixel's first sample: others have another light

uint light_word(vec3 light)
{
    const float steps = CONTRAST_STEPS / log2((1.0 + CONTRAST_LEAST) / (1.0 - CONTRAST_LEAST));
    float brightest = max(light.r, max(light.g, light.b));
    vec3 octaves = log2(max(light, max(brightest * CONTRAST_CHANNEL_LEAST, CONTRAST_DARKEST)) *
                        (1.0 / CONTRAST_DARKEST));
    uvec3 m = uvec3(min(octaves * steps + 0.5, 1023.0));
    return m.r | m.g << 10 | m.b << 20;
}

bool light_words_differ(uint a, uint b)
{
    const uvec3 shift = uvec3(0u, 10u, 20u);
    ivec3 x = ivec3(uvec3(a) >> shift & 1023u), y = ivec3(uvec3(b) >> shift & 1023u);
    return any(greaterThan(abs(x - y), ivec3(CONTRAST_STEPS)));
}

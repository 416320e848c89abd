// SPDX-License-Identifier: MIT
// Khronos PBR Neutral, of colours that are finite and not negative. Provides: tame, map_neutral.
#include "shared/layout.h"
#include "shared/tone_curve.h"

// Not a number, infinite and negative become 0, by their bits: comparisons with NaN are not
// specified.
float tame(float value)
{
    bool is_finite = floatBitsToUint(value) - 1u < 0x7f7fffffu;
    return is_finite ? min(value, TONE_RADIANCE_MAX) : 0.0;
}

vec3 map_neutral(vec3 c)
{
    precise vec3 lowered = c - tone_offset(min(min(c.r, c.g), c.b));
    float peak = max(max(lowered.r, lowered.g), lowered.b);
    if (peak < TONE_START_COMPRESSION)
        return lowered;
    float new_peak = tone_new_peak(peak), white_share = tone_white_share(peak, new_peak);
    precise float scale = new_peak / peak;
    return vec3(tone_compress(lowered.r, scale, new_peak, white_share),
                tone_compress(lowered.g, scale, new_peak, white_share),
                tone_compress(lowered.b, scale, new_peak, white_share));
}

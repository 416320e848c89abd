// SPDX-License-Identifier: MIT
// Tone mappings of colours that are finite and not negative. Provides: tame, map_tones: Khronos
// neutral, or with TONE_HAS_CHOICE the one that the uniform u_operator names. Without the choice a
// large program carries no mapping that its pictures do not use.
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

#ifndef TONE_HAS_CHOICE
vec3 map_tones(vec3 c)
{
    return map_neutral(c);
}
#else
uniform uint u_operator; // TONE_OPERATOR_*; any other leaves colours alone

vec3 map_agx(vec3 c)
{
    float r = tone_agx_contrast(TONE_AGX_INSET_R(c.r, c.g, c.b));
    float g = tone_agx_contrast(TONE_AGX_INSET_G(c.r, c.g, c.b));
    float b = tone_agx_contrast(TONE_AGX_INSET_B(c.r, c.g, c.b));
    return vec3(tone_agx_linear(TONE_AGX_OUTSET_R(r, g, b)),
                tone_agx_linear(TONE_AGX_OUTSET_G(r, g, b)),
                tone_agx_linear(TONE_AGX_OUTSET_B(r, g, b)));
}

vec3 map_aces(vec3 c)
{
    float r = tone_aces_fit(TONE_ACES_IN_R(c.r, c.g, c.b));
    float g = tone_aces_fit(TONE_ACES_IN_G(c.r, c.g, c.b));
    float b = tone_aces_fit(TONE_ACES_IN_B(c.r, c.g, c.b));
    return max(vec3(TONE_ACES_OUT_R(r, g, b), TONE_ACES_OUT_G(r, g, b), TONE_ACES_OUT_B(r, g, b)),
               vec3(0.0));
}

vec3 map_tones(vec3 c)
{
    switch (u_operator) {
    case TONE_OPERATOR_NEUTRAL: return map_neutral(c);
    case TONE_OPERATOR_AGX: return map_agx(c);
    case TONE_OPERATOR_ACES: return map_aces(c);
    default: return c;
    }
}
#endif

/* SPDX-License-Identifier: MIT */
/* Khronos PBR Neutral and the table of sRGB codes, one text for C and GLSL: the processor and the
 * device round alike, but for the device's divisions. Khronos PBR Neutral Tone Mapper specification
 * (2024), section "Reference implementation"; the symbols are those of the specification. */
#ifndef VITRAIL_SHADERS_SHARED_TONE_CURVE_H
#define VITRAIL_SHADERS_SHARED_TONE_CURVE_H

#ifdef GL_core_profile
#define TONE_FUNCTION
#else
#define TONE_FUNCTION static inline
#define precise /* no multiplication is contracted with an addition */
#endif

#define TONE_START_COMPRESSION (0.8f - 0.04f)
#define TONE_DESATURATION 0.15f
#define TONE_RADIANCE_MAX 1e30f /* products stay inside f32; far beyond white */

/* What every channel loses to the Fresnel reflection of dielectrics; low: the least channel. */
TONE_FUNCTION float tone_offset(float low)
{
    precise float offset = low < 0.08f ? low - 6.25f * low * low : 0.04f;
    return offset;
}

/* The greatest channel compressed below 1, from TONE_START_COMPRESSION on. */
TONE_FUNCTION float tone_new_peak(float peak)
{
    const float d = 1.0f - TONE_START_COMPRESSION;
    precise float new_peak = 1.0f - d * d / (peak + d - TONE_START_COMPRESSION);
    return new_peak;
}

/* The share of white in a compressed colour. */
TONE_FUNCTION float tone_white_share(float peak, float new_peak)
{
    precise float share = 1.0f - 1.0f / (TONE_DESATURATION * (peak - new_peak) + 1.0f);
    return share;
}

/* A channel of a compressed colour. scale: new_peak / peak. */
TONE_FUNCTION float tone_compress(float channel, float scale, float new_peak, float white_share)
{
    precise float scaled = channel * scale;
    precise float mixed = scaled + (new_peak - scaled) * white_share;
    return mixed;
}

/* IEC 61966-2-1 encodes x to round(255 * oetf(x)). The codes change at 255 thresholds; a bucket is
 * all floats in [2^-13, 1) with the same exponent and the same 7 leading bits of mantissa, and is
 * narrow enough to hold one threshold at most, so that code(x) = code at its lower end, plus one
 * from the threshold on. Below 2^-13 the code is 0 (the first threshold is 1.52e-4). */
#define TONE_BUCKET_SHIFT 16u    /* of the bits of a float: 23 - 7 */
#define TONE_BUCKETS 1664u       /* 13 exponents of 128 */
#define TONE_FIRST_BUCKET 14592u /* (127 - 13) * 128 */

struct tone_bucket {
    float threshold; /* of the next code; above 1 where the bucket has none */
    uint code;
};
LAYOUT(tone_bucket, code, 4)

#ifndef GL_core_profile
#undef precise
#endif
#endif

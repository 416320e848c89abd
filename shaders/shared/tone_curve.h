/* SPDX-License-Identifier: MIT */
/* Tone mappings and the table of sRGB codes, one text for C and GLSL: the processor and the device
 * round alike, but for the device's divisions. Radiances are finite and not negative. */
#ifndef VITRAIL_SHADERS_SHARED_TONE_CURVE_H
#define VITRAIL_SHADERS_SHARED_TONE_CURVE_H

#ifdef GL_core_profile
#define TONE_FUNCTION
#define TONE_BITS(x) floatBitsToUint(x)
#define TONE_OF_BITS(x) uintBitsToFloat(x)
#else
#include <string.h>
#define TONE_FUNCTION static inline
#define precise /* no multiplication is contracted with an addition */
TONE_FUNCTION uint TONE_BITS(float x)
{
    uint bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
TONE_FUNCTION float TONE_OF_BITS(uint bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}
#endif

/* enum tone_mapping of renderer/image/tone_map.h */
#define TONE_OPERATOR_NEUTRAL 0u
#define TONE_OPERATOR_AGX 2u
#define TONE_OPERATOR_ACES 3u

/* Khronos PBR Neutral Tone Mapper specification (2024), section "Reference implementation"; the
 * symbols are those of the specification. */
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

/* A row of a 3 x 3 matrix times a colour. */
TONE_FUNCTION float tone_row(float x, float y, float z, float r, float g, float b)
{
    precise float sum = x * r + y * g + z * b;
    return sum;
}

/* ---- AgX ---- */

/* Sobotka 2022, AgX, as Wrensch 2023, "Minimal AgX Implementation", has it: inset, log2 between two
 * stops, a polynomial fit of the default contrast, outset, and a display of gamma 2.2. The matrices
 * are those of the article, which are of Rec.709. */
#define TONE_AGX_INSET_R(r, g, b) \
    tone_row(0.842479062253094f, 0.0784335999999992f, 0.0792237451477643f, r, g, b)
#define TONE_AGX_INSET_G(r, g, b) \
    tone_row(0.0423282422610123f, 0.878468636469772f, 0.0791661274605434f, r, g, b)
#define TONE_AGX_INSET_B(r, g, b) \
    tone_row(0.0423756549057051f, 0.0784336f, 0.879142973793104f, r, g, b)
#define TONE_AGX_OUTSET_R(r, g, b) \
    tone_row(1.19687900512017f, -0.0980208811401368f, -0.0990297440797205f, r, g, b)
#define TONE_AGX_OUTSET_G(r, g, b) \
    tone_row(-0.0528968517574562f, 1.15190312990417f, -0.0989611768448433f, r, g, b)
#define TONE_AGX_OUTSET_B(r, g, b) \
    tone_row(-0.0529716355144438f, -0.0980434501171241f, 1.15107367264116f, r, g, b)
#define TONE_AGX_LEAST_EV -12.47393f
#define TONE_AGX_MOST_EV 4.026069f

/* Of normal numbers, within 1e-7; of 0 it is about -127. log2(1 + f) / f is interpolated at the
 * Chebyshev nodes of 1 + f in [sqrt(1/2), sqrt(2)]. */
TONE_FUNCTION float tone_log2(float x)
{
    const uint low = 0x3f3504f3u; /* sqrt(1/2) */
    uint shifted = TONE_BITS(x) + (0x3f800000u - low);
    float f = TONE_OF_BITS((shifted & 0x7fffffu) + low) - 1.0f;
    float exponent = TONE_OF_BITS(0x4b000000u | shifted >> 23u) - (8388608.0f + 127.0f);
    precise float p = 0.232652575f - 0.142759740f * f;
    p = -0.249271825f + p * f;
    p = 0.287288874f + p * f;
    p = -0.360225171f + p * f;
    p = 0.480916709f + p * f;
    p = -0.721352935f + p * f;
    p = 1.442695022f + p * f;
    p = exponent + p * f;
    return p;
}

/* Of exponents in [-126, 127], within 2e-7 of the result, by the same means. */
TONE_FUNCTION float tone_exp2(float x)
{
    const float round_up = 12582912.0f; /* 1.5 * 2^23: a sum with it is a whole number */
    precise float sum = x + round_up;
    precise float f = x - (sum - round_up);
    precise float p = 0.009676032f + 0.001339086f * f;
    p = 0.055503570f + p * f;
    p = 0.240221068f + p * f;
    p = 0.693147182f + p * f;
    p = 1.000000119f + p * f;
    p = p * TONE_OF_BITS((TONE_BITS(sum) - TONE_BITS(round_up) + 127u) << 23u);
    return p;
}

/* A channel after the inset, as the display takes it. */
TONE_FUNCTION float tone_agx_contrast(float channel)
{
    const float range = TONE_AGX_MOST_EV - TONE_AGX_LEAST_EV;
    precise float x = (tone_log2(channel) - TONE_AGX_LEAST_EV) * (1.0f / range);
    x = x > 0.0f ? x : 0.0f;
    x = x < 1.0f ? x : 1.0f;
    precise float y = -40.14f + 15.5f * x;
    y = 31.96f + y * x;
    y = -6.868f + y * x;
    y = 0.4298f + y * x;
    y = 0.1191f + y * x;
    y = -0.00232f + y * x;
    return y;
}

/* A channel after the outset, in linear light: its power of 2.2. */
TONE_FUNCTION float tone_agx_linear(float display)
{
    float y = display > 0.0f ? display : 1.0f;
    precise float fifth = tone_exp2(0.2f * tone_log2(y));
    precise float linear = y * y * fifth;
    return display > 0.0f ? linear : 0.0f;
}

/* ---- ACES ---- */

/* Hill 2016, ACES.hlsl of "BakingLab" (Pettineo and Hill): a fit of the reference rendering
 * transform and the output transform for sRGB displays, as in the file, without a factor before. */
#define TONE_ACES_IN_R(r, g, b) tone_row(0.59719f, 0.35458f, 0.04823f, r, g, b)
#define TONE_ACES_IN_G(r, g, b) tone_row(0.07600f, 0.90834f, 0.01566f, r, g, b)
#define TONE_ACES_IN_B(r, g, b) tone_row(0.02840f, 0.13383f, 0.83777f, r, g, b)
#define TONE_ACES_OUT_R(r, g, b) tone_row(1.60475f, -0.53108f, -0.07367f, r, g, b)
#define TONE_ACES_OUT_G(r, g, b) tone_row(-0.10208f, 1.10813f, -0.00605f, r, g, b)
#define TONE_ACES_OUT_B(r, g, b) tone_row(-0.00327f, -0.07276f, 1.07602f, r, g, b)
#define TONE_ACES_MAX 1e6f /* squares stay inside f32, and the fit within 1e-6 of its limit */

TONE_FUNCTION float tone_aces_fit(float channel)
{
    float v = channel < TONE_ACES_MAX ? channel : TONE_ACES_MAX;
    precise float a = v * (v + 0.0245786f) - 0.000090537f;
    precise float b = v * (0.983729f * v + 0.4329510f) + 0.238081f;
    return a / b;
}

/* ---- sRGB ---- */

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

/* SPDX-License-Identifier: MIT */
/* Exposure, Khronos PBR Neutral, and the exactly rounded sRGB transfer function. */
#include "renderer/image/tone_map.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/image/linear.h"

/* Khronos PBR Neutral Tone Mapper specification (2024), section "Reference implementation". */
#define START_COMPRESSION (0.8f - 0.04f)
#define DESATURATION 0.15f
#define RADIANCE_MAX 1e30f /* products stay inside f32; far beyond white */

/* IEC 61966-2-1 encodes x to round(255 * oetf(x)). The codes change at 255 thresholds; a bucket is
 * all floats in [2^-13, 1) with the same exponent and the same 7 leading bits of mantissa, and is
 * narrow enough to hold one threshold at most, so that code(x) = code at its lower end, plus one
 * from the threshold on. Below 2^-13 the code is 0 (the first threshold is 1.52e-4). */
enum { BUCKET_BITS = 7, EXPONENTS = 13, BUCKETS = EXPONENTS << BUCKET_BITS };
#define FIRST_BUCKET ((127u - EXPONENTS) << BUCKET_BITS)

struct srgb_bucket {
    float threshold; /* of the next code; above 1 where the bucket has none */
    uint32_t code;
};

static void fill_buckets(struct srgb_bucket *buckets)
{
    float thresholds[256]; /* of code + 1: where rounding goes up */
    for (int code = 0; code < 255; code++)
        thresholds[code] = (float)srgb_to_linear((code + 0.5) / 255);
    thresholds[255] = 2;
    uint32_t code = 0;
    for (uint32_t i = 0; i < BUCKETS; i++) {
        uint32_t bits = (FIRST_BUCKET + i) << (23 - BUCKET_BITS);
        float low;
        memcpy(&low, &bits, sizeof low);
        while (low >= thresholds[code])
            code++;
        buckets[i] = (struct srgb_bucket){.threshold = thresholds[code], .code = code};
    }
}

/* x in [0, 1]. */
static uint8_t encode_srgb(const struct srgb_bucket *buckets, float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    uint32_t bucket = bits >> (23 - BUCKET_BITS);
    if (bucket < FIRST_BUCKET)
        return 0;
    if (x >= 1)
        return 255;
    const struct srgb_bucket *b = &buckets[bucket - FIRST_BUCKET];
    return (uint8_t)(b->code + (x >= b->threshold));
}

static float min3(const float c[3])
{
    float low = c[0] < c[1] ? c[0] : c[1];
    return low < c[2] ? low : c[2];
}

static float max3(const float c[3])
{
    float high = c[0] > c[1] ? c[0] : c[1];
    return high > c[2] ? high : c[2];
}

static void map_neutral(float c[3])
{
    float x = min3(c);
    float offset = x < 0.08f ? x - 6.25f * x * x : 0.04f;
    for (int i = 0; i < 3; i++)
        c[i] -= offset;
    float peak = max3(c);
    if (peak < START_COMPRESSION)
        return;
    const float d = 1 - START_COMPRESSION;
    float new_peak = 1 - d * d / (peak + d - START_COMPRESSION);
    float g = 1 - 1 / (DESATURATION * (peak - new_peak) + 1);
    for (int i = 0; i < 3; i++) {
        float scaled = c[i] * (new_peak / peak);
        c[i] = scaled + (new_peak - scaled) * g;
    }
}

/* NaN and infinity become 0, and so do negative radiances; large ones are cut at RADIANCE_MAX. */
static float tame(float value)
{
    return value > 0 && value <= __FLT_MAX__ ? (value < RADIANCE_MAX ? value : RADIANCE_MAX) : 0;
}

static void map_pixel(const struct srgb_bucket *buckets, const float in[4], float gain,
                      bool is_neutral, uint8_t out[4])
{
    float alpha = tame(in[3]);
    alpha = alpha < 1 ? alpha : 1;
    float scale = alpha > 0 && alpha < 1 ? gain / alpha : gain;
    float c[3];
    for (int i = 0; i < 3; i++) {
        float product = tame(in[i]) * scale;
        c[i] = alpha > 0 ? product < RADIANCE_MAX ? product : RADIANCE_MAX : 0;
    }
    if (is_neutral)
        map_neutral(c);
    for (int i = 0; i < 3; i++)
        out[i] = encode_srgb(buckets, c[i] < 1 ? (c[i] > 0 ? c[i] : 0) : 1);
    out[3] = (uint8_t)(alpha * 255 + 0.5f);
}

bool tone_map(const struct image *hdr, const struct tone_map_desc *desc, struct image *ldr,
              struct error *err)
{
    memset(ldr, 0, sizeof *ldr);
    if (hdr->component != IMAGE_F32 || hdr->channels != 4 || !hdr->pixels)
        return error_set(err, ERROR_INTERNAL, "tone mapping takes an RGBA image of F32");
    if (!isfinite(desc->exposure_ev))
        return error_set(err, ERROR_INVALID_REQUEST, "exposure_ev is not finite");
    struct srgb_bucket *buckets = malloc(BUCKETS * sizeof *buckets);
    if (!buckets)
        return error_set(err, ERROR_NO_MEMORY, "tone mapping table");
    bool is_done = image_init(ldr, hdr->width_px, hdr->height_px, 4, IMAGE_U8, err);
    if (is_done) {
        fill_buckets(buckets);
        float gain = exp2f(fminf(fmaxf(desc->exposure_ev, -100), 100));
        bool is_neutral = desc->operator_ == TONE_MAPPING_NEUTRAL;
        const float *in = hdr->pixels;
        uint8_t *out = ldr->pixels;
        size_t count = (size_t)hdr->width_px * (size_t)hdr->height_px;
        for (size_t i = 0; i < count; i++)
            map_pixel(buckets, in + 4 * i, gain, is_neutral, out + 4 * i);
    }
    free(buckets);
    return is_done;
}

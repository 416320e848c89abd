/* SPDX-License-Identifier: MIT */
/* Exposure, tone mappings, and the exactly rounded sRGB transfer function. */
#include "renderer/image/tone_map.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/image/linear.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/tone_curve.h"

static_assert(TONE_OPERATOR_NEUTRAL == TONE_MAPPING_NEUTRAL, "uniform u_operator");
static_assert(TONE_OPERATOR_AGX == TONE_MAPPING_AGX, "uniform u_operator");
static_assert(TONE_OPERATOR_ACES == TONE_MAPPING_ACES, "uniform u_operator");

void tone_map_fill_buckets(struct tone_bucket *buckets)
{
    float thresholds[256]; /* of code + 1: where rounding goes up */
    for (int code = 0; code < 255; code++)
        thresholds[code] = (float)srgb_to_linear((code + 0.5) / 255);
    thresholds[255] = 2;
    uint32_t code = 0;
    for (uint32_t i = 0; i < TONE_BUCKETS; i++) {
        uint32_t bits = (TONE_FIRST_BUCKET + i) << TONE_BUCKET_SHIFT;
        float low;
        memcpy(&low, &bits, sizeof low);
        while (low >= thresholds[code])
            code++;
        buckets[i] = (struct tone_bucket){.threshold = thresholds[code], .code = code};
    }
}

/* x in [0, 1]. */
static uint8_t encode_srgb(const struct tone_bucket *buckets, float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    uint32_t bucket = bits >> TONE_BUCKET_SHIFT;
    if (bucket < TONE_FIRST_BUCKET)
        return 0;
    if (x >= 1)
        return 255;
    const struct tone_bucket *b = &buckets[bucket - TONE_FIRST_BUCKET];
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
    float offset = tone_offset(min3(c));
    for (int i = 0; i < 3; i++)
        c[i] -= offset;
    float peak = max3(c);
    if (peak < TONE_START_COMPRESSION)
        return;
    float new_peak = tone_new_peak(peak), white_share = tone_white_share(peak, new_peak);
    float scale = new_peak / peak;
    for (int i = 0; i < 3; i++)
        c[i] = tone_compress(c[i], scale, new_peak, white_share);
}

static void map_agx(float c[3])
{
    float r = tone_agx_contrast(TONE_AGX_INSET_R(c[0], c[1], c[2]));
    float g = tone_agx_contrast(TONE_AGX_INSET_G(c[0], c[1], c[2]));
    float b = tone_agx_contrast(TONE_AGX_INSET_B(c[0], c[1], c[2]));
    c[0] = tone_agx_linear(TONE_AGX_OUTSET_R(r, g, b));
    c[1] = tone_agx_linear(TONE_AGX_OUTSET_G(r, g, b));
    c[2] = tone_agx_linear(TONE_AGX_OUTSET_B(r, g, b));
}

static void map_aces(float c[3])
{
    float r = tone_aces_fit(TONE_ACES_IN_R(c[0], c[1], c[2]));
    float g = tone_aces_fit(TONE_ACES_IN_G(c[0], c[1], c[2]));
    float b = tone_aces_fit(TONE_ACES_IN_B(c[0], c[1], c[2]));
    c[0] = fmaxf(TONE_ACES_OUT_R(r, g, b), 0);
    c[1] = fmaxf(TONE_ACES_OUT_G(r, g, b), 0);
    c[2] = fmaxf(TONE_ACES_OUT_B(r, g, b), 0);
}

static void map_tones(enum tone_mapping operator_, float c[3])
{
    switch (operator_) {
    case TONE_MAPPING_NEUTRAL:
        map_neutral(c);
        return;
    case TONE_MAPPING_AGX:
        map_agx(c);
        return;
    case TONE_MAPPING_ACES:
        map_aces(c);
        return;
    case TONE_MAPPING_NONE:
        return;
    }
}

/* NaN and infinity become 0, and so do negative radiances; large ones are cut. */
static float tame(float value)
{
    bool is_finite = value > 0 && value <= __FLT_MAX__;
    return is_finite ? (value < TONE_RADIANCE_MAX ? value : TONE_RADIANCE_MAX) : 0;
}

static void map_pixel(const struct tone_bucket *buckets, const float in[4], float gain,
                      enum tone_mapping operator_, uint8_t out[4])
{
    float alpha = tame(in[3]);
    alpha = alpha < 1 ? alpha : 1;
    float scale = alpha > 0 && alpha < 1 ? gain / alpha : gain;
    float c[3];
    for (int i = 0; i < 3; i++) {
        float product = tame(in[i]) * scale;
        c[i] = alpha > 0 ? product < TONE_RADIANCE_MAX ? product : TONE_RADIANCE_MAX : 0;
    }
    map_tones(operator_, c);
    for (int i = 0; i < 3; i++)
        out[i] = encode_srgb(buckets, c[i] < 1 ? (c[i] > 0 ? c[i] : 0) : 1);
    out[3] = (uint8_t)(alpha * 255 + 0.5f);
}

float tone_map_gain(const struct tone_map_desc *desc)
{
    return exp2f(fminf(fmaxf(desc->exposure_ev, -100), 100));
}

/* Of values that are tame. */
static void map_radiance(enum tone_mapping operator_, float c[3])
{
    map_tones(operator_, c);
    for (int i = 0; i < 3; i++)
        c[i] = c[i] < 1 ? c[i] : 1;
}

void tone_map_color(const struct tone_map_desc *desc, float color[3])
{
    float gain = tone_map_gain(desc);
    for (int i = 0; i < 3; i++)
        color[i] = fminf(tame(color[i]) * gain, TONE_RADIANCE_MAX);
    map_radiance(desc->operator_, color);
}

void tone_map_over(const struct tone_map_desc *desc, const float backdrop[4],
                   const struct tone_map_over *pixel, float out[4])
{
    float covered = pixel->covered, through[3] = {0}, lit[3] = {0}, unlit[3] = {0};
    float seen = (pixel->behind[0] + pixel->behind[1] + pixel->behind[2]) / 3 + 1 - covered;
    if (covered > 0) {
        float scale = tone_map_gain(desc) / covered;
        for (int i = 0; i < 3; i++) {
            through[i] = unlit[i] = backdrop[i] * pixel->behind[i] / covered;
            lit[i] = fminf(tame(pixel->radiance[i]) * scale + through[i], TONE_RADIANCE_MAX);
        }
        map_radiance(desc->operator_, lit);
        map_radiance(desc->operator_, unlit);
    }
    for (int i = 0; i < 3; i++)
        out[i] = backdrop[i] * (1 - covered) + fmaxf(through[i] + (lit[i] - unlit[i]), 0) * covered;
    out[3] = 1 - (1 - backdrop[3]) * seen;
}

bool tone_map(const struct image *hdr, const struct tone_map_desc *desc, struct image *ldr,
              struct error *err)
{
    memset(ldr, 0, sizeof *ldr);
    if (hdr->component != IMAGE_F32 || hdr->channels != 4 || !hdr->pixels)
        return error_set(err, ERROR_INTERNAL, "tone mapping takes an RGBA image of F32");
    if (!isfinite(desc->exposure_ev))
        return error_set(err, ERROR_INVALID_REQUEST, "exposure_ev is not finite");
    struct tone_bucket *buckets = malloc(TONE_BUCKETS * sizeof *buckets);
    if (!buckets)
        return error_set(err, ERROR_NO_MEMORY, "tone mapping table");
    bool is_done = image_init(ldr, hdr->width_px, hdr->height_px, 4, IMAGE_U8, err);
    if (is_done) {
        tone_map_fill_buckets(buckets);
        float gain = tone_map_gain(desc);
        const float *in = hdr->pixels;
        uint8_t *out = ldr->pixels;
        size_t count = (size_t)hdr->width_px * (size_t)hdr->height_px;
        for (size_t i = 0; i < count; i++)
            map_pixel(buckets, in + 4 * i, gain, desc->operator_, out + 4 * i);
    }
    free(buckets);
    return is_done;
}

/* SPDX-License-Identifier: MIT */
/* Exposure, tone mappings, and the exactly rounded sRGB transfer function. */
#include "renderer/image/tone_map.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/processor_forms.h"
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

/* Pixels side by side, as processors take them. */
enum { BLOCK = 64 };
struct block {
    _Alignas(64) float c[3][BLOCK], alpha[BLOCK];
};

INSIDE_FORMS float min2(float a, float b)
{
    return a < b ? a : b;
}

INSIDE_FORMS float max2(float a, float b)
{
    return a > b ? a : b;
}

/* Nothing branches: below, pixels stand side by side. */
INSIDE_FORMS void map_neutral(float c[3])
{
    float offset = tone_offset(min2(min2(c[0], c[1]), c[2]));
    float r = c[0] - offset, g = c[1] - offset, b = c[2] - offset;
    float peak = max2(max2(r, g), b);
    float new_peak = tone_new_peak(peak), white_share = tone_white_share(peak, new_peak);
    float scale = new_peak / peak; /* of no use where the peak is low */
    float compressed_r = tone_compress(r, scale, new_peak, white_share);
    float compressed_g = tone_compress(g, scale, new_peak, white_share);
    float compressed_b = tone_compress(b, scale, new_peak, white_share);
    c[0] = peak < TONE_START_COMPRESSION ? r : compressed_r;
    c[1] = peak < TONE_START_COMPRESSION ? g : compressed_g;
    c[2] = peak < TONE_START_COMPRESSION ? b : compressed_b;
}

INSIDE_FORMS void map_agx(float c[3])
{
    float r = tone_agx_contrast(TONE_AGX_INSET_R(c[0], c[1], c[2]));
    float g = tone_agx_contrast(TONE_AGX_INSET_G(c[0], c[1], c[2]));
    float b = tone_agx_contrast(TONE_AGX_INSET_B(c[0], c[1], c[2]));
    c[0] = tone_agx_linear(TONE_AGX_OUTSET_R(r, g, b));
    c[1] = tone_agx_linear(TONE_AGX_OUTSET_G(r, g, b));
    c[2] = tone_agx_linear(TONE_AGX_OUTSET_B(r, g, b));
}

INSIDE_FORMS void map_aces(float c[3])
{
    float r = tone_aces_fit(TONE_ACES_IN_R(c[0], c[1], c[2]));
    float g = tone_aces_fit(TONE_ACES_IN_G(c[0], c[1], c[2]));
    float b = tone_aces_fit(TONE_ACES_IN_B(c[0], c[1], c[2]));
    c[0] = max2(TONE_ACES_OUT_R(r, g, b), 0);
    c[1] = max2(TONE_ACES_OUT_G(r, g, b), 0);
    c[2] = max2(TONE_ACES_OUT_B(r, g, b), 0);
}

/* Black stays black. */
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
INSIDE_FORMS float tame(float value)
{
    float cut = min2(value, TONE_RADIANCE_MAX);
    return ((value > 0) & (value <= __FLT_MAX__)) ? cut : 0;
}

INSIDE_FORMS void load(struct block *block, const float *in, float gain)
{
    for (int i = 0; i < BLOCK; i++) {
        float alpha = min2(tame(in[4 * i + 3]), 1);
        float scale = gain / (alpha > 0 ? alpha : 1);
        for (int k = 0; k < 3; k++) {
            float product = min2(tame(in[4 * i + k]) * scale, TONE_RADIANCE_MAX);
            block->c[k][i] = alpha > 0 ? product : 0;
        }
        block->alpha[i] = alpha;
    }
}

#define MAP_BLOCK(map)                                                       \
    for (int i = 0; i < BLOCK; i++) {                                        \
        float c[3] = {block->c[0][i], block->c[1][i], block->c[2][i]};       \
        map(c);                                                              \
        block->c[0][i] = c[0], block->c[1][i] = c[1], block->c[2][i] = c[2]; \
    }

/* x in [0, 1]. The first bucket stands for those below, which end before its threshold; the last
 * one for 1, too. */
INSIDE_FORMS uint32_t encode_srgb(const struct tone_bucket *buckets, float x)
{
    const int32_t last = TONE_BUCKETS - 1;
    int32_t bits, bucket;
    memcpy(&bits, &x, sizeof bits);
    bucket = (bits >> TONE_BUCKET_SHIFT) - (int32_t)TONE_FIRST_BUCKET;
    bucket = bucket < 0 ? 0 : bucket < last ? bucket : last;
    return buckets[bucket].code + (x >= buckets[bucket].threshold);
}

INSIDE_FORMS void store(const struct block *block, const struct tone_bucket *buckets, uint8_t *out)
{
    uint32_t codes[BLOCK]; /* R in the lowest byte */
    for (int i = 0; i < BLOCK; i++) {
        uint32_t rgba = (uint32_t)(int32_t)(block->alpha[i] * 255 + 0.5f) << 24;
        for (int k = 0; k < 3; k++)
            rgba |= encode_srgb(buckets, max2(min2(block->c[k][i], 1), 0)) << 8 * k;
        codes[i] = rgba;
    }
    for (int i = 0; i < BLOCK; i++)
        for (int k = 0; k < 4; k++)
            out[4 * i + k] = (uint8_t)(codes[i] >> 8 * k);
}

PROCESSOR_FORMS static void map_block(const struct tone_bucket *buckets, const float *in,
                                      float gain, enum tone_mapping operator_, uint8_t *out)
{
    struct block whole, *block = &whole;
    load(block, in, gain);
    if (operator_ == TONE_MAPPING_NEUTRAL)
        MAP_BLOCK(map_neutral)
    else if (operator_ == TONE_MAPPING_AGX)
        MAP_BLOCK(map_agx)
    else if (operator_ == TONE_MAPPING_ACES)
        MAP_BLOCK(map_aces)
    store(block, buckets, out);
}

static void map_pixels(const struct tone_bucket *buckets, const struct image *hdr,
                       const struct tone_map_desc *desc, uint8_t *out)
{
    const float gain = tone_map_gain(desc), *in = hdr->pixels;
    size_t count = (size_t)hdr->width_px * (size_t)hdr->height_px, i = 0;
    for (; i + BLOCK <= count; i += BLOCK)
        map_block(buckets, in + 4 * i, gain, desc->operator_, out + 4 * i);
    if (i < count) {
        float rest[4 * BLOCK] = {0};
        uint8_t mapped[4 * BLOCK];
        memcpy(rest, in + 4 * i, 4 * (count - i) * sizeof *rest);
        map_block(buckets, rest, gain, desc->operator_, mapped);
        memcpy(out + 4 * i, mapped, 4 * (count - i));
    }
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
        if (through[0] > 0 || through[1] > 0 || through[2] > 0)
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
        map_pixels(buckets, hdr, desc, ldr->pixels);
    }
    free(buckets);
    return is_done;
}

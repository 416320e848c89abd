/* SPDX-License-Identifier: MIT */
/* Differences of images and of transmittances at points. Rows are summed plainly, rows with
 * compensation; the percentile is found by counting the bits of f32 differences, upper half first,
 * so that no copy of the image is sorted. */
#include "renderer/accuracy/metrics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/accuracy/percentile.h"
#include "renderer/accuracy/sum.h"

/* ---- what can be compared ---- */

bool image_pair_check(const struct image *image, const struct image *reference, struct error *err)
{
    const struct image *both[] = {image, reference};
    static const char *const names[] = {"image", "reference"};
    for (int i = 0; i < 2; i++) {
        if (!both[i]->pixels || both[i]->width_px <= 0 || both[i]->height_px <= 0 ||
            both[i]->channels <= 0)
            return error_set(err, ERROR_INVALID_REQUEST, "the %s is empty", names[i]);
        if (both[i]->component != IMAGE_F32)
            return error_set(err, ERROR_INVALID_REQUEST, "the %s is not of 32-bit floats",
                             names[i]);
    }
    if (image->width_px != reference->width_px || image->height_px != reference->height_px)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "the image is %d x %d pixels, the reference %d x %d", image->width_px,
                         image->height_px, reference->width_px, reference->height_px);
    if (image->channels != reference->channels)
        return error_set(err, ERROR_INVALID_REQUEST, "the image has %d channels, the reference %d",
                         image->channels, reference->channels);
    return true;
}

/* ---- images ---- */

struct channel_sums {
    struct sum square, absolute, image, reference;
    uint64_t codes[PERCENTILE_CODES]; /* of |d| by one half of its f32 bits */
    uint32_t upper;                   /* the upper half of the percentile's bits, once known */
};

struct measurement {
    const struct image_metrics_desc *desc;
    struct image_metrics *metrics;
    uint32_t channels;
    struct channel_sums *sums; /* [channels of the image + 1], the last one is of all together */
};

static float value_at(const struct image *image, int x, int y, int channel)
{
    size_t pixel = (size_t)y * (size_t)image->width_px + (size_t)x;
    return ((const float *)image->pixels)[pixel * (size_t)image->channels + (size_t)channel];
}

static bool values_are_same(float a, float b)
{
    return a == b || (isnan(a) && isnan(b));
}

static void count_nonfinite(struct image_metrics *metrics, struct metric_values *values, float a,
                            float b)
{
    metrics->nonfinite_image += !isfinite(a);
    metrics->nonfinite_reference += !isfinite(b);
    metrics->nonfinite_mismatch += isnan(a) || isnan(b) || a != b;
    values->differing += !values_are_same(a, b);
}

static void measure_row(struct measurement *m, int y, int channel)
{
    const struct image *image = m->desc->image, *reference = m->desc->reference;
    struct metric_values *values = &m->metrics->channel[channel];
    struct channel_sums *sums = &m->sums[channel];
    double square = 0, absolute = 0, total_image = 0, total_reference = 0;
    for (int x = 0; x < image->width_px; x++) {
        float a = value_at(image, x, y, channel), b = value_at(reference, x, y, channel);
        if (!isfinite(a) || !isfinite(b)) {
            count_nonfinite(m->metrics, values, a, b);
            continue;
        }
        double d = fabs((double)a - (double)b);
        square += d * d;
        absolute += d;
        total_image += (double)a;
        total_reference += (double)b;
        sums->codes[percentile_bits(d) >> 16]++;
        values->compared++;
        values->differing += d > 0;
        if (d > values->max) {
            values->max = d;
            values->max_x = x;
            values->max_y = y;
        }
    }
    sum_add(&sums->square, square);
    sum_add(&sums->absolute, absolute);
    sum_add(&sums->image, total_image);
    sum_add(&sums->reference, total_reference);
}

static void count_lower_halves(struct measurement *m, int target, int channel)
{
    const struct image *image = m->desc->image, *reference = m->desc->reference;
    struct channel_sums *sums = &m->sums[target];
    for (int y = 0; y < image->height_px; y++)
        for (int x = 0; x < image->width_px; x++) {
            float a = value_at(image, x, y, channel), b = value_at(reference, x, y, channel);
            if (!isfinite(a) || !isfinite(b))
                continue;
            uint32_t bits = percentile_bits(fabs((double)a - (double)b));
            if (bits >> 16 == sums->upper)
                sums->codes[bits & 0xffff]++;
        }
}

/* Sums and upper halves are counted: finds the lower half of the percentile's bits. target: whose
 * percentile, channels: which ones it is over. */
static double find_percentile(struct measurement *m, int target, uint32_t channels, uint64_t count)
{
    struct channel_sums *sums = &m->sums[target];
    uint64_t rank = percentile_rank(count, 1000);
    if (!rank)
        return 0;
    sums->upper = percentile_code(sums->codes, &rank);
    memset(sums->codes, 0, sizeof sums->codes);
    for (int c = 0; c < m->desc->image->channels; c++)
        if (channels & 1u << c)
            count_lower_halves(m, target, c);
    uint32_t bits = sums->upper << 16 | percentile_code(sums->codes, &rank);
    return percentile_from_bits(bits);
}

static void finish_values(struct metric_values *values, const struct channel_sums *sums)
{
    if (!values->compared)
        return;
    double count = (double)values->compared;
    values->rmse = sqrt(sum_value(&sums->square) / count);
    values->mae = sum_value(&sums->absolute) / count;
    values->mean_image = sum_value(&sums->image) / count;
    values->mean_reference = sum_value(&sums->reference) / count;
}

static void add_channel_to_overall(struct measurement *m, int channel)
{
    struct metric_values *all = &m->metrics->overall;
    const struct metric_values *one = &m->metrics->channel[channel];
    struct channel_sums *to = &m->sums[m->metrics->channels];
    const struct channel_sums *from = &m->sums[channel];
    all->compared += one->compared;
    all->differing += one->differing;
    bool is_earlier =
        one->max_y < all->max_y || (one->max_y == all->max_y && one->max_x < all->max_x);
    if (one->max > all->max || (one->max > 0 && one->max == all->max && is_earlier)) {
        all->max = one->max;
        all->max_x = one->max_x;
        all->max_y = one->max_y;
        all->max_channel = channel;
    }
    sum_add(&to->square, sum_value(&from->square));
    sum_add(&to->absolute, sum_value(&from->absolute));
    sum_add(&to->image, sum_value(&from->image));
    sum_add(&to->reference, sum_value(&from->reference));
    for (int i = 0; i < PERCENTILE_CODES; i++)
        to->codes[i] += from->codes[i];
}

static void measure(struct measurement *m)
{
    int count = m->metrics->channels;
    struct metric_values *overall = &m->metrics->overall;
    for (int y = 0; y < m->desc->image->height_px; y++)
        for (int c = 0; c < count; c++)
            if (m->channels & 1u << c)
                measure_row(m, y, c);
    for (int c = 0; c < count; c++)
        if (m->channels & 1u << c)
            add_channel_to_overall(m, c);
    for (int c = 0; c < count; c++)
        if (m->channels & 1u << c) {
            struct metric_values *values = &m->metrics->channel[c];
            values->max_channel = c;
            finish_values(values, &m->sums[c]);
            values->p999 = find_percentile(m, c, 1u << c, values->compared);
        }
    finish_values(overall, &m->sums[count]);
    overall->p999 = find_percentile(m, count, m->channels, overall->compared);
}

bool image_metrics_measure(const struct image_metrics_desc *desc, struct image_metrics *metrics,
                           struct error *err)
{
    memset(metrics, 0, sizeof *metrics);
    if (!image_pair_check(desc->image, desc->reference, err))
        return false;
    int channels = desc->image->channels;
    uint32_t all = channels < 32 ? (1u << channels) - 1 : UINT32_MAX;
    if (desc->channels & ~all)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "channel %d is asked for, the images have %d channels",
                         31 - __builtin_clz(desc->channels), channels);
    struct measurement m = {.desc = desc,
                            .metrics = metrics,
                            .channels = desc->channels ? desc->channels : all,
                            .sums = calloc((size_t)channels + 1, sizeof *m.sums)};
    if (!m.sums)
        return error_set(err, ERROR_NO_MEMORY, "metrics of %d channels", channels);
    metrics->channels = channels;
    measure(&m);
    free(m.sums);
    return true;
}

static uint64_t hash_byte(uint64_t hash, uint8_t byte)
{
    return (hash ^ byte) * 0x100000001b3u;
}

static uint64_t hash_number(uint64_t hash, int number)
{
    for (int shift = 0; shift < 32; shift += 8)
        hash = hash_byte(hash, (uint8_t)((uint32_t)number >> shift));
    return hash;
}

uint64_t image_metrics_hash(const struct image *image)
{
    uint64_t hash = hash_number(0xcbf29ce484222325u, image->width_px);
    hash = hash_number(hash, image->height_px);
    hash = hash_number(hash, image->channels);
    hash = hash_number(hash, (int)image->component);
    const uint8_t *bytes = image->pixels;
    size_t count = bytes ? image_size_bytes(image) : 0;
    for (size_t i = 0; i < count; i++)
        hash = hash_byte(hash, bytes[i]);
    return hash;
}

/* ---- transmittance at points ---- */

struct probe_sums {
    struct sum absolute, square;
};

static void measure_tau(struct probe_metrics *metrics, double t, double reference, size_t point,
                        int channel)
{
    if (t <= 0 || reference <= 0) {
        metrics->opaque_mismatch += (t <= 0) != (reference <= 0);
        return;
    }
    double tau = fabs(log(t) - log(reference));
    if (tau > metrics->max_tau) {
        metrics->max_tau = tau;
        metrics->max_tau_point = point;
        metrics->max_tau_channel = channel;
    }
}

static void measure_probe(struct probe_metrics *metrics, struct probe_sums *sums, double t,
                          double reference, size_t point, int channel)
{
    if (!isfinite(t) || !isfinite(reference)) {
        metrics->nonfinite++;
        return;
    }
    double d = fabs(t - reference);
    metrics->compared++;
    sum_add(&sums->absolute, d);
    sum_add(&sums->square, d * d);
    if (d > metrics->max) {
        metrics->max = d;
        metrics->max_point = point;
        metrics->max_channel = channel;
    }
    if (reference > PROBE_RELATIVE_MIN) {
        metrics->relative_compared++;
        if (d / reference > metrics->max_relative) {
            metrics->max_relative = d / reference;
            metrics->max_relative_point = point;
            metrics->max_relative_channel = channel;
        }
    }
    measure_tau(metrics, t, reference, point, channel);
}

static void end_probes(struct probe_metrics *metrics, const struct probe_sums *sums)
{
    if (!metrics->compared)
        return;
    metrics->mean = sum_value(&sums->absolute) / (double)metrics->compared;
    metrics->rmse = sqrt(sum_value(&sums->square) / (double)metrics->compared);
}

bool image_transmittance_measure(const struct image_metrics_desc *desc,
                                 struct probe_metrics *metrics, struct error *err)
{
    struct probe_sums sums = {0};
    memset(metrics, 0, sizeof *metrics);
    if (!image_pair_check(desc->image, desc->reference, err))
        return false;
    int channels = desc->image->channels;
    size_t pixels = (size_t)desc->image->width_px * (size_t)desc->image->height_px;
    const float *t = desc->image->pixels, *reference = desc->reference->pixels;
    for (size_t i = 0; i < pixels; i++, t += channels, reference += channels)
        for (int c = 0; c < channels; c++)
            if (!desc->channels || desc->channels & 1u << c)
                measure_probe(metrics, &sums, (double)t[c], (double)reference[c], i, c);
    end_probes(metrics, &sums);
    return true;
}

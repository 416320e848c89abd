/* SPDX-License-Identifier: MIT */
/* A histogram of log2 luminance, whose bins hold sums of it, so that means have no steps. */
#include "renderer/image/exposure.h"

#include <assert.h>
#include <math.h>

#include "shaders/shared/layout.h"

#include "shaders/shared/tone_curve.h"

enum { BINS = 256, BINS_PER_STOP = 4, LEAST_STOP = -32 };

/* Shares of the pixels: of those that come to middle grey; highlights are above. Chosen by eye over
 * products, interiors and lamps in the picture. */
#define DARK_SHARE 0.25
#define BRIGHT_SHARE 0.95
/* Lamps in the picture may make it darker by so much, and are white then: what they light is to be
 * seen, too. */
#define HIGHLIGHT_LESS_EV 1.0

struct histogram {
    double weight[BINS], sum[BINS]; /* of pixels, and of their stops */
    double total;
};

static bool is_light(float value)
{
    return value > 0 && value <= __FLT_MAX__;
}

static void count(struct histogram *histogram, const float pixel[4])
{
    double alpha = is_light(pixel[3]) ? fmin((double)pixel[3], 1) : 0, channels[3];
    if (alpha == 0)
        return;
    for (int i = 0; i < 3; i++)
        channels[i] = is_light(pixel[i]) ? (double)pixel[i] : 0;
    /* Rec.709 */
    double luminance = 0.2126 * channels[0] + 0.7152 * channels[1] + 0.0722 * channels[2];
    float shown = (float)fmin(luminance / alpha, (double)TONE_RADIANCE_MAX);
    double stop = shown > 0 ? (double)tone_log2(shown) : LEAST_STOP;
    if (stop <= LEAST_STOP)
        return;
    stop = fmin(stop, LEAST_STOP + (double)BINS / BINS_PER_STOP);
    int bin = (int)((stop - LEAST_STOP) * BINS_PER_STOP);
    bin = bin < BINS ? bin : BINS - 1;
    histogram->weight[bin] += alpha;
    histogram->sum[bin] += alpha * stop;
    histogram->total += alpha;
}

/* The mean stop of the pixels between two shares, the darkest first; a bin counts by the part of it
 * that lies between. */
static double mean_between(const struct histogram *histogram, double from, double to)
{
    double below = 0, weight = 0, sum = 0;
    for (int bin = 0; bin < BINS; bin++) {
        double own = histogram->weight[bin];
        double first = fmax(below, from * histogram->total);
        double last = fmin(below + own, to * histogram->total);
        if (last > first) {
            weight += last - first;
            sum += histogram->sum[bin] / own * (last - first);
        }
        below += own;
    }
    return weight > 0 ? sum / weight : 0;
}

float exposure_meter(const struct image *linear)
{
    struct histogram histogram = {.total = 0};
    assert(linear->component == IMAGE_F32 && linear->channels == 4);
    const float *pixels = linear->pixels;
    size_t pixel_count = (size_t)linear->width_px * (size_t)linear->height_px;
    for (size_t i = 0; i < pixel_count; i++)
        count(&histogram, pixels + 4 * i);
    if (histogram.total == 0)
        return 0;
    double ev = log2(EXPOSURE_MIDDLE_GREY) - mean_between(&histogram, DARK_SHARE, BRIGHT_SHARE);
    double over = mean_between(&histogram, BRIGHT_SHARE, 1) + ev; /* of 1, in stops */
    ev -= fmin(fmax(over, 0), HIGHLIGHT_LESS_EV);
    ev = fmin(fmax(ev, -EXPOSURE_MOST_EV), EXPOSURE_MOST_EV);
    return (float)(rint(ev * EXPOSURE_STEPS_PER_EV) / EXPOSURE_STEPS_PER_EV);
}

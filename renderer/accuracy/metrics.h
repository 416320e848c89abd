/* SPDX-License-Identifier: MIT */
/* Statistics of the difference between an image and a reference, or between transmittances at
 * points, accumulated in f64. Pure C, no GL. Thread: any. */
#ifndef VITRAIL_RENDERER_ACCURACY_METRICS_H
#define VITRAIL_RENDERER_ACCURACY_METRICS_H

#include <stddef.h>
#include <stdint.h>

#include "renderer/image/image.h"

/* Of one channel, or of all compared channels together; in the unit of the image (linear radiance
 * for a color output). Differences are image - reference in f64. */
struct metric_values {
    double rmse; /* sqrt(mean(d^2)) */
    double mae;  /* mean(|d|) */
    double p999; /* the smallest |d|, rounded to f32, that 99.9 % of all |d| do not exceed */
    double max;  /* max(|d|) */
    double mean_image, mean_reference; /* energy */
    uint64_t compared;                 /* pairs of finite values: what all of the above is over */
    uint64_t differing;                /* pairs, finite or not, that are not the same number */
    int max_x, max_y, max_channel;     /* of the first `max` in reading order; y 0 is the top row */
};

struct image_metrics {
    int channels;                                     /* of both images */
    struct metric_values channel[IMAGE_CHANNELS_MAX]; /* zeroed where not asked for */
    struct metric_values overall;
    /* NaN and infinities are counted here and left out of every value above. */
    uint64_t nonfinite_image, nonfinite_reference;
    uint64_t nonfinite_mismatch; /* pairs with a NaN, or not the same infinity on both sides: an
                                    error of unbounded size */
};

struct image_metrics_desc {
    const struct image *image, *reference; /* required; F32, of one size and channel count */
    uint32_t channels; /* bit set of 1u << channel; 0 means all; 7 is RGB without alpha */
};

/* All zero when the images are the same. ERROR_INVALID_REQUEST names both sizes, both channel
 * counts or the component type when they do not fit, an empty image, and a channel that is not
 * there. Three passes over the data and 0.5 MB per channel; docs/reference/accuracy.md has the
 * speed. */
MUST_CHECK bool image_metrics_measure(const struct image_metrics_desc *desc,
                                      struct image_metrics *metrics, struct error *err);

/* Refuses a pair that cannot be compared, as above; every metric of this folder does so first. */
MUST_CHECK bool image_pair_check(const struct image *image, const struct image *reference,
                                 struct error *err);

/* FNV-1a, 64 bits (Fowler, Noll, Vo 1991) of size, channels, component and every bit of the pixels:
 * two images are equal to the bit if their hashes are, as far as a test of determinism cares. */
uint64_t image_metrics_hash(const struct image *image);

/* ---- transmittance ---- */

#define PROBE_RELATIVE_MIN 1e-4 /* below, only absolute errors mean anything */

struct probe_metrics {
    double max, mean, rmse; /* of |T - T_ref| over all values */
    double max_relative;    /* of |T - T_ref| / T_ref where T_ref > PROBE_RELATIVE_MIN */
    double max_tau; /* of |ln T - ln T_ref| where both are > 0: right down to what an image holds */
    size_t max_point, max_relative_point, max_tau_point; /* index of the point, channel */
    int max_channel, max_relative_channel, max_tau_channel;
    uint64_t compared;          /* pairs of finite values */
    uint64_t relative_compared; /* those above PROBE_RELATIVE_MIN */
    uint64_t opaque_mismatch;   /* exactly one of the two is 0: no tau tells how far */
    uint64_t nonfinite;         /* pairs with a value that is not finite, left out everywhere */
};

/* Of every pixel of two images of transmittances; a point is a pixel in reading order.
 * Errors as image_metrics_measure. */
MUST_CHECK bool image_transmittance_measure(const struct image_metrics_desc *desc,
                                            struct probe_metrics *metrics, struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* Deep images: of each pixel a list of samples, front to back, each with its depth and opacity.
 * Thread: any, one at a time. */
#ifndef VITRAIL_RENDERER_IMAGE_DEEP_IMAGE_H
#define VITRAIL_RENDERER_IMAGE_DEEP_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

/* What lies between two depths. Over what is behind it a sample is color + (1 - opacity) * behind,
 * in each channel by itself. */
struct deep_sample {
    float depth, back; /* m along the view direction; equal for surfaces; +inf: the background */
    float color[3];    /* linear radiance, associated */
    float opacity[3];  /* [0, 1] */
};

struct deep_pixel {
    size_t first; /* of its samples */
    uint32_t count;
};

struct deep_image { /* zeroed = empty */
    int width_px, height_px;
    struct deep_pixel *pixels; /* row by row from the top */
    struct deep_sample *samples;
    size_t count, room; /* of samples */
};

enum { DEEP_SAMPLES_MAX = 16 << 20 }; /* of an image: 512 MiB, and as much while it is encoded */

MUST_CHECK bool deep_image_init(struct deep_image *image, int width_px, int height_px,
                                struct error *err);
/* Room for so many samples more. ERROR_TOO_LARGE above DEEP_SAMPLES_MAX. */
MUST_CHECK bool deep_image_reserve(struct deep_image *image, size_t count, struct error *err);
/* Gives the pixel its samples; there must be room. */
void deep_image_set(struct deep_image *image, int x_px, int y_px, const struct deep_sample *samples,
                    uint32_t count);
void deep_image_finish(struct deep_image *image); /* accepts zeroed */

struct deep_encode_desc {
    const char *description; /* optional, as in struct image_encode_desc */
    const char *provenance;  /* likewise */
};
/* A deep scanline OpenEXR: Z, ZBack, R, G, B, the opacities AR, AG and AB, and A, their mean.
 * *bytes is malloc'ed. */
MUST_CHECK bool deep_image_encode(const struct deep_image *image,
                                  const struct deep_encode_desc *desc, void **bytes,
                                  size_t *size_bytes, struct error *err);

#endif

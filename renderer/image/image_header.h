/* SPDX-License-Identifier: MIT */
/* What an encoded image is and how large, from its first bytes: asked before any decoder sees it.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_IMAGE_HEADER_H
#define VITRAIL_RENDERER_IMAGE_IMAGE_HEADER_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

enum image_kind {
    IMAGE_KIND_PNG,
    IMAGE_KIND_JPEG,
    IMAGE_KIND_WEBP,
    IMAGE_KIND_EXR,
    IMAGE_KIND_HDR,
    IMAGE_KIND_BMP,
    IMAGE_KIND_TGA,
};

struct image_header {
    enum image_kind kind;
    uint32_t width_px, height_px;
    /* Of PNG (a palette: 3; with alpha of tRNS) and JPEG, bits per channel; 0: unknown. */
    int channels, bits;
};

/* ERROR_UNSUPPORTED names a format that is known but not read, ERROR_INVALID_SCENE tells of a
 * broken header. */
MUST_CHECK bool image_header_read(struct image_header *header, const void *bytes, size_t size_bytes,
                                  struct error *err);

/* The same, and BMP and TGA. */
MUST_CHECK bool image_header_read_old(struct image_header *header, const void *bytes,
                                      size_t size_bytes, struct error *err);

#endif

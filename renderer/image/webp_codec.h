/* SPDX-License-Identifier: MIT */
/* WebP through libwebp itself: OpenImageIO 2.4 divides by and multiplies with alpha on its way in
 * and out, whatever method is set, and always searches with method 6, seconds for a large frame.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_WEBP_CODEC_H
#define VITRAIL_RENDERER_IMAGE_WEBP_CODEC_H

#include "renderer/image/image.h"

struct webp_file_desc {
    int quality;     /* [1, 100], 100 is lossless */
    const char *xmp; /* a packet that the file holds; or NULL */
    size_t xmp_bytes;
};

/* image: U8 with 3 or 4 channels, straight alpha. *bytes is malloc'ed. */
MUST_CHECK bool webp_encode(const struct image *image, const struct webp_file_desc *desc,
                            void **bytes, size_t *size_bytes, struct error *err);

/* Into *image (initialised here), U8 RGBA with straight alpha. Animations give an error. */
MUST_CHECK bool webp_decode(const void *bytes, size_t size_bytes, struct image *image,
                            struct error *err);

#endif

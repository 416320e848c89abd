/* SPDX-License-Identifier: MIT */
/* PNG through libpng itself: the format of most replies and textures, and a process that needs no
 * other format need not load OpenImageIO with its 250 libraries. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_PNG_CODEC_H
#define VITRAIL_RENDERER_IMAGE_PNG_CODEC_H

#include "renderer/image/image.h"

struct png_file_desc {
    int level;               /* of zlib, [0, 9] */
    const char *description; /* optional; a text with the keyword Description */
    const char *provenance;  /* optional; a text with PROVENANCE_PNG_KEYWORD */
};

/* image: U8 or U16 with 1 to 4 channels, straight alpha, taken as sRGB. *bytes is malloc'ed. */
MUST_CHECK bool png_file_encode(const struct image *image, const struct png_file_desc *desc,
                                void **bytes, size_t *size_bytes, struct error *err);

/* Into *image (initialised here), U8 RGBA with straight alpha; or, of a file of 16 bits and with
 * keep_16_bits, U16 with the 1 to 4 channels of the file. Every kind of PNG is read: palettes, less
 * than 8 bits, one transparent colour, interlaced. Gamma and profiles are ignored. */
MUST_CHECK bool png_file_decode(const void *bytes, size_t size_bytes, bool keep_16_bits,
                                struct image *image, struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* Writing PNG through libpng itself: the format of most replies, and a process that writes no other
 * need not load OpenImageIO with its 250 libraries. Thread: any. */
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

#endif

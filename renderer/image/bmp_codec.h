/* SPDX-License-Identifier: MIT */
/* Reading Windows bitmaps (BMP) of 1, 4, 8, 16, 24 and 32 bits, with palettes, bit fields and run
 * lengths; headers of OS/2 1 and of Windows 3 to 5. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_BMP_CODEC_H
#define VITRAIL_RENDERER_IMAGE_BMP_CODEC_H

#include "renderer/image/image.h"
#include "renderer/image/image_header.h"

/* False: the header is broken, or the pixels that it tells of are not there. */
bool bmp_header_read(struct image_header *header, const uint8_t *bytes, size_t size_bytes);

/* Into *image (initialised here), U8 RGBA with straight alpha. Alpha that is 0 everywhere was not
 * meant: the image is opaque. */
MUST_CHECK bool bmp_decode(const uint8_t *bytes, size_t size_bytes, struct image *image,
                           struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* Reading Truevision TGA, 1989, "Truevision TGA File Format Specification": true colour, grey and
 * palettes, plain or with run lengths. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_TGA_CODEC_H
#define VITRAIL_RENDERER_IMAGE_TGA_CODEC_H

#include "renderer/image/image.h"
#include "renderer/image/image_header.h"

/* Whether the bytes can be such a file, which has no letters of its own in front; then its size. */
bool tga_header_read(struct image_header *header, const uint8_t *bytes, size_t size_bytes);

/* Into *image (initialised here), U8 RGBA with straight alpha. Alpha that is 0 everywhere was not
 * meant: the image is opaque. */
MUST_CHECK bool tga_decode(const uint8_t *bytes, size_t size_bytes, struct image *image,
                           struct error *err);

#endif

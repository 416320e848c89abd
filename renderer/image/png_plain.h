/* SPDX-License-Identifier: MIT */
/* PNG as most files are, read faster than libpng can: grey, RGB or RGBA of 8 bits, rows from top to
 * bottom, no transparent colour. Built where libdeflate is there. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_PNG_PLAIN_H
#define VITRAIL_RENDERER_IMAGE_PNG_PLAIN_H

#include "renderer/image/image.h"

/* Into *image (initialised here), U8 RGBA with straight alpha, the same bits as libpng's. False:
 * the file is of another kind, or damaged, or memory is short; libpng is to read it, and to say
 * what is wrong with it. */
MUST_CHECK bool png_plain_decode(const void *bytes, size_t size_bytes, struct image *image);

#endif

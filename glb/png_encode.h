/* SPDX-License-Identifier: MIT */
/* RGBA8 pixels to PNG bytes in memory. Thread: any. */
#ifndef VITRAIL_GLB_PNG_ENCODE_H
#define VITRAIL_GLB_PNG_ENCODE_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

/* rgba: width_px * height_px * 4 bytes, first row on top. The alpha channel is left out when every
 * pixel is opaque. *png is malloc'ed, the caller frees it. The same pixels give the same bytes with
 * the same libpng and zlib. Errors: ERROR_INVALID_REQUEST for a side outside [1, 16384],
 * ERROR_NO_MEMORY, ERROR_INTERNAL from libpng. */
MUST_CHECK bool png_encode(const uint8_t *rgba, int width_px, int height_px, void **png,
                           size_t *size_bytes, struct error *err);

#endif

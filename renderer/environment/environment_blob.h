/* SPDX-License-Identifier: MIT */
/* A map of radiance as a file: what the decoder leaves and the worker maps. Thread: any.
 *
 * Little endian: a header of ENVIRONMENT_BLOB_HEADER_BYTES, then the pixels of struct
 * environment_desc. */
#ifndef VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_BLOB_H
#define VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_BLOB_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "renderer/environment/environment.h"

enum { ENVIRONMENT_BLOB_VERSION = 1, ENVIRONMENT_BLOB_HEADER_BYTES = 32 };

void environment_blob_write_header(int width, int height,
                                   uint8_t header[ENVIRONMENT_BLOB_HEADER_BYTES]);

/* The pixels are borrowed from bytes, which are aligned to 4. ERROR_INVALID_ENVIRONMENT for another
 * version, a size that is not allowed and one that does not fit the header. */
MUST_CHECK bool environment_blob_open(const void *bytes, size_t size_bytes,
                                      struct environment_desc *desc, struct error *err);

#endif

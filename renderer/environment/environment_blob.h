/* SPDX-License-Identifier: MIT */
/* A map of radiance as a file, with all that is derived from it: the decoder computes it once, and
 * workers map it. Thread: any.
 *
 * Little endian: a header of ENVIRONMENT_BLOB_HEADER_BYTES, then the arrays of struct environment,
 * those of f64 first. */
#ifndef VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_BLOB_H
#define VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_BLOB_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "renderer/environment/environment.h"

enum {
    ENVIRONMENT_BLOB_VERSION = 2,
    ENVIRONMENT_BLOB_HEADER_BYTES = 32,
    ENVIRONMENT_BLOB_ARRAYS = 4 + ENVIRONMENT_LEVELS,
};

struct environment_blob_part {
    const void *bytes; /* borrowed of the environment */
    size_t size_bytes;
};

/* The blob is the header and, close behind it and each other, these parts. */
void environment_blob_parts(const struct environment *environment,
                            uint8_t header[ENVIRONMENT_BLOB_HEADER_BYTES],
                            struct environment_blob_part parts[ENVIRONMENT_BLOB_ARRAYS]);

/* The environment borrows bytes, which are aligned to 8, and only reads them. NULL with
 * ERROR_INVALID_ENVIRONMENT for another version, a size that does not fit the header, and numbers
 * that no map has, or with ERROR_NO_MEMORY. */
struct environment *environment_blob_open(void *bytes, size_t size_bytes, struct error *err);

#endif

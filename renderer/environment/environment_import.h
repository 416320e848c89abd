/* SPDX-License-Identifier: MIT */
/* From the bytes of an image to a map of radiance. Thread: any. */
#ifndef VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_IMPORT_H
#define VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_IMPORT_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

/* Texels that are kept: lobes of a roughness above 0.05 are wider than one of them. */
enum {
    ENVIRONMENT_KEPT_WIDTH = 2048,
    ENVIRONMENT_KEPT_HEIGHT = 1024,
};

/* Zeroed = empty. */
struct environment_import {
    float *pixels;                   /* owned; as in struct environment_desc, none below 0 */
    int width, height;               /* at most those above */
    int source_width, source_height; /* of the image */
    uint64_t negative_texels;        /* of the image: those with a channel below 0 */
    double mean[3];                  /* radiance over all directions [nt]; that of the image */
    double peak;                     /* the greatest channel of the image [nt] */
};

/* Reads an equirectangular image, Radiance HDR or OpenEXR, of at most ENVIRONMENT_WIDTH_MAX x
 * ENVIRONMENT_HEIGHT_MAX texels: its channels R, G and B, or Y alone, as radiance in nt. Larger
 * ones than are kept are averaged over boxes, weighted by solid angle, so that the mean stays what
 * it is; channels below 0 count as 0. Checks the size before anything is allocated.
 * ERROR_TOO_LARGE names the limit; ERROR_INVALID_ENVIRONMENT for what is broken, cut off or no such
 * image, and for NaN, infinity and more than ENVIRONMENT_RADIANCE_MAX, with the texel;
 * ERROR_UNSUPPORTED for other channels. */
MUST_CHECK bool environment_import(const void *bytes, size_t size_bytes,
                                   struct environment_import *import, struct error *err);
void environment_import_finish(struct environment_import *import); /* accepts zeroed */

#endif

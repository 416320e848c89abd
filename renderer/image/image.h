/* SPDX-License-Identifier: MIT */
/* Images in memory, and their encoding to files by name of format. Thread: any, one image on one
 * thread at a time. */
#ifndef VITRAIL_RENDERER_IMAGE_IMAGE_H
#define VITRAIL_RENDERER_IMAGE_IMAGE_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

#ifdef __cplusplus
extern "C" {
#endif

enum image_component { IMAGE_U8, IMAGE_U16, IMAGE_U32, IMAGE_F32 };

enum { IMAGE_CHANNEL_NAME_BYTES = 32, IMAGE_CHANNELS_MAX = 32 };

/* Row-major, first row on top, channels interleaved, no padding between rows. Zeroed = empty. */
struct image {
    int width_px, height_px;
    int channels; /* [1, IMAGE_CHANNELS_MAX] */
    enum image_component component;
    void *pixels; /* owned; width * height * channels components, malloc'ed */
    /* "" = by convention R,G,B,A or Y. */
    char channel_names[IMAGE_CHANNELS_MAX][IMAGE_CHANNEL_NAME_BYTES];
};

size_t image_size_bytes(const struct image *image);

/* Allocates zeroed pixels. Refuses sizes that are not positive or overflow. */
MUST_CHECK bool image_init(struct image *image, int width_px, int height_px, int channels,
                           enum image_component component, struct error *err);
void image_finish(struct image *image); /* accepts zeroed */

/* U8 RGBA whose alpha is 0 everywhere becomes opaque: many writers of old formats leave it so. */
void image_make_opaque_if_clear(struct image *image);

enum image_format {
    IMAGE_FORMAT_PNG,
    IMAGE_FORMAT_JPEG,
    IMAGE_FORMAT_WEBP,
    IMAGE_FORMAT_EXR,
    IMAGE_FORMAT_COUNT
};

const char *image_format_name(enum image_format format);       /* "png" ... */
const char *image_format_media_type(enum image_format format); /* "image/png", "image/x-exr" ... */
bool image_format_from_name(const char *name, enum image_format *format); /* also "jpg" */

struct image_encode_desc {
    enum image_format format;
    int quality;             /* JPEG and WebP, [1, 100]; 0 means 90; WebP 100 is lossless */
    const char *description; /* optional, borrowed; stored, but in WebP */
    const char *provenance;  /* optional, borrowed; as protocol/provenance_file.h has it in files */
};

/* Encodes into freshly malloc'ed memory that the caller frees. PNG takes U8 or U16, JPEG and WebP
 * U8 (JPEG drops alpha), EXR F32 or U32 (lossless ZIP). Alpha of U8/U16 images is unassociated, of
 * EXR associated. */
MUST_CHECK bool image_encode(const struct image *image, const struct image_encode_desc *desc,
                             void **bytes, size_t *size_bytes, struct error *err);

/* Loads what writing EXR and reading EXR and HDR needs, so that the first such file does
 * not wait for it. */
void image_warm_up(void);

struct image_decode_desc {
    uint64_t max_pixels; /* refuse larger images before decoding; 0 means 64 Mi pixels */
    bool keep_float;     /* EXR/HDR stay F32 with their channels; else all becomes U8 RGBA */
    bool keep_16_bits;   /* PNG of 16 bits stays U16 with its 1 to 4 channels */
    bool takes_old;      /* BMP and TGA, too, which scenes of other formats than glTF have */
};

/* Decodes PNG, JPEG and WebP to U8 RGBA (PNG of 16 bits to U16 if keep_16_bits; EXR and HDR, too,
 * if keep_float) by magic bytes; every other format is refused. */
MUST_CHECK bool image_decode(const void *bytes, size_t size_bytes,
                             const struct image_decode_desc *desc, struct image *image,
                             struct error *err);

#ifdef __cplusplus
}
#endif
#endif

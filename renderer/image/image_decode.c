/* SPDX-License-Identifier: MIT */
/* Decoding: header first, then the one decoder of that format. */
#include "renderer/image/image.h"

#include <limits.h>
#include <string.h>

#include "renderer/image/bmp_codec.h"
#include "renderer/image/image_header.h"
#include "renderer/image/image_library.h"
#include "renderer/image/jpeg_codec.h"
#include "renderer/image/png_codec.h"
#include "renderer/image/tga_codec.h"
#include "renderer/image/webp_codec.h"

#define MAX_PIXELS_DEFAULT (64ull << 20)

static bool check_size(const struct image_header *header, uint64_t max_pixels, struct error *err)
{
    if (header->width_px > INT_MAX || header->height_px > INT_MAX ||
        (uint64_t)header->width_px * header->height_px > max_pixels)
        return error_set(err, ERROR_TOO_LARGE, "the image is %u x %u, limit is %llu pixels",
                         header->width_px, header->height_px, (unsigned long long)max_pixels);
    return true;
}

static bool decode(const void *bytes, size_t size_bytes, const struct image_header *header,
                   const struct image_decode_desc *desc, struct image *image, struct error *err)
{
    const struct oiio_functions *library;
    switch (header->kind) {
    case IMAGE_KIND_PNG:
        return png_file_decode(bytes, size_bytes, desc->keep_16_bits, image, err);
    case IMAGE_KIND_JPEG:
        return jpeg_file_decode(bytes, size_bytes, image, err);
    case IMAGE_KIND_WEBP:
        return webp_decode(bytes, size_bytes, image, err);
    case IMAGE_KIND_BMP:
        return bmp_decode(bytes, size_bytes, image, err);
    case IMAGE_KIND_TGA:
        return tga_decode(bytes, size_bytes, image, err);
    default:
        library = image_library(err);
        return library &&
               library->decode(bytes, size_bytes,
                               header->kind == IMAGE_KIND_EXR ? "openexr" : "hdr", image, err);
    }
}

static bool check_decoded(const struct image *image, const struct image_header *header,
                          struct error *err)
{
    if ((uint32_t)image->width_px != header->width_px ||
        (uint32_t)image->height_px != header->height_px)
        return error_set(err, ERROR_INVALID_SCENE, "the image is %d x %d, its header says %u x %u",
                         image->width_px, image->height_px, header->width_px, header->height_px);
    return true;
}

bool image_decode(const void *bytes, size_t size_bytes, const struct image_decode_desc *desc,
                  struct image *image, struct error *err)
{
    memset(image, 0, sizeof *image);
    struct image_header header;
    if (desc->takes_old ? !image_header_read_old(&header, bytes, size_bytes, err)
                        : !image_header_read(&header, bytes, size_bytes, err))
        return false;
    if ((header.kind == IMAGE_KIND_EXR || header.kind == IMAGE_KIND_HDR) && !desc->keep_float)
        return error_set(err, ERROR_UNSUPPORTED,
                         "floating-point images are not read here, only PNG, JPEG and WebP");
    if (!check_size(&header, desc->max_pixels ? desc->max_pixels : MAX_PIXELS_DEFAULT, err) ||
        !decode(bytes, size_bytes, &header, desc, image, err))
        return false;
    if (check_decoded(image, &header, err))
        return true;
    image_finish(image);
    return false;
}

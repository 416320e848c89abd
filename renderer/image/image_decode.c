/* SPDX-License-Identifier: MIT */
/* Decoding: header first, then the one decoder of that format, then the channels wanted. */
#include "renderer/image/image.h"

#include <limits.h>
#include <string.h>

#include "renderer/image/bmp_codec.h"
#include "renderer/image/image_header.h"
#include "renderer/image/image_library.h"
#include "renderer/image/tga_codec.h"
#include "renderer/image/webp_codec.h"

#define MAX_PIXELS_DEFAULT (64ull << 20)

static const char *const oiio_names[] = {[IMAGE_KIND_PNG] = "png",
                                         [IMAGE_KIND_JPEG] = "jpeg",
                                         [IMAGE_KIND_EXR] = "openexr",
                                         [IMAGE_KIND_HDR] = "hdr"};

static bool check_size(const struct image_header *header, uint64_t max_pixels, struct error *err)
{
    if (header->width_px > INT_MAX || header->height_px > INT_MAX ||
        (uint64_t)header->width_px * header->height_px > max_pixels)
        return error_set(err, ERROR_TOO_LARGE, "the image is %u x %u, limit is %llu pixels",
                         header->width_px, header->height_px, (unsigned long long)max_pixels);
    return true;
}

/* From grey, grey-alpha, RGB or RGBA to RGBA. */
static bool expand_to_rgba(struct image *image, struct error *err)
{
    int n = image->channels;
    if (n == 4) {
        memset(image->channel_names, 0, sizeof image->channel_names);
        return true;
    }
    struct image rgba;
    if (!image_init(&rgba, image->width_px, image->height_px, 4, IMAGE_U8, err))
        return false;
    size_t count = (size_t)image->width_px * (size_t)image->height_px;
    const uint8_t *in = image->pixels;
    uint8_t *out = rgba.pixels;
    for (size_t i = 0; i < count; i++, in += n, out += 4) {
        for (int c = 0; c < 3; c++)
            out[c] = in[n < 3 ? 0 : c];
        out[3] = n == 2 ? in[1] : 255;
    }
    image_finish(image);
    *image = rgba;
    return true;
}

static bool decode(const void *bytes, size_t size_bytes, const struct image_header *header,
                   const struct image_decode_desc *desc, struct image *image, struct error *err)
{
    enum image_kind kind = header->kind;
    if (kind == IMAGE_KIND_WEBP)
        return webp_decode(bytes, size_bytes, image, err);
    if (kind == IMAGE_KIND_BMP)
        return bmp_decode(bytes, size_bytes, image, err);
    if (kind == IMAGE_KIND_TGA)
        return tga_decode(bytes, size_bytes, image, err);
    bool is_float = kind == IMAGE_KIND_EXR || kind == IMAGE_KIND_HDR;
    bool is_deep = desc->keep_16_bits && kind == IMAGE_KIND_PNG && header->bits == 16;
    const struct oiio_functions *library = image_library(err);
    return library && library->decode(bytes, size_bytes, oiio_names[kind],
                                      is_float  ? IMAGE_F32
                                      : is_deep ? IMAGE_U16
                                                : IMAGE_U8,
                                      image, err);
}

static bool check_decoded(const struct image *image, const struct image_header *header,
                          struct error *err)
{
    if ((uint32_t)image->width_px != header->width_px ||
        (uint32_t)image->height_px != header->height_px)
        return error_set(err, ERROR_INVALID_SCENE, "the image is %d x %d, its header says %u x %u",
                         image->width_px, image->height_px, header->width_px, header->height_px);
    if ((image->component == IMAGE_U8 || image->component == IMAGE_U16) && image->channels > 4)
        return error_set(err, ERROR_UNSUPPORTED, "the image has %d channels", image->channels);
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
    if (check_decoded(image, &header, err) &&
        (image->component != IMAGE_U8 || expand_to_rgba(image, err)))
        return true;
    image_finish(image);
    return false;
}

/* SPDX-License-Identifier: MIT */
/* Encoding: which component and channels each format takes, and its options. */
#include "renderer/image/image.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/provenance_file.h"
#include "renderer/image/image_library.h"
#include "renderer/image/png_codec.h"
#include "renderer/image/webp_codec.h"

enum {
    QUALITY_DEFAULT = 90,
    /* Of zlib: measured on 1280 x 720 frames, a third of the time of 6 for some 3 % more bytes. */
    PNG_LEVEL = 4,
    OPTIONS_MAX = 7,
};

static bool takes_component(enum image_format format, enum image_component component)
{
    switch (format) {
    case IMAGE_FORMAT_PNG:
        return component == IMAGE_U8 || component == IMAGE_U16;
    case IMAGE_FORMAT_EXR:
        return component == IMAGE_F32 || component == IMAGE_U32;
    default:
        return component == IMAGE_U8;
    }
}

static bool check(const struct image *image, const struct image_encode_desc *desc,
                  struct error *err)
{
    if ((unsigned)desc->format >= IMAGE_FORMAT_COUNT)
        return error_set(err, ERROR_INVALID_REQUEST, "image format %d is not known",
                         (int)desc->format);
    if (desc->quality < 0 || desc->quality > 100)
        return error_set(err, ERROR_INVALID_REQUEST, "quality is %d, not in [1, 100]",
                         desc->quality);
    if (!image->pixels || image->width_px <= 0 || image->height_px <= 0)
        return error_set(err, ERROR_INVALID_REQUEST, "the image is empty");
    const char *name = image_format_name(desc->format);
    if (!takes_component(desc->format, image->component))
        return error_set(err, ERROR_NOT_ACCEPTABLE, "%s does not hold this kind of number", name);
    if (desc->format != IMAGE_FORMAT_EXR && image->channels > 4)
        return error_set(err, ERROR_NOT_ACCEPTABLE, "%s holds 4 channels, the image has %d", name,
                         image->channels);
    return true;
}

/* From grey, grey-alpha, RGB or RGBA to RGB or RGBA (JPEG and WebP know no other); alpha is kept
 * only if `has_alpha`. */
static bool convert_channels(const struct image *from, bool has_alpha, struct image *to,
                             struct error *err)
{
    int n = from->channels;
    if (!image_init(to, from->width_px, from->height_px, has_alpha ? 4 : 3, IMAGE_U8, err))
        return false;
    size_t count = (size_t)from->width_px * (size_t)from->height_px;
    const uint8_t *in = from->pixels;
    uint8_t *out = to->pixels;
    for (size_t i = 0; i < count; i++, in += n, out += to->channels) {
        for (int c = 0; c < 3; c++)
            out[c] = in[n < 3 ? 0 : c];
        if (has_alpha)
            out[3] = in[n - 1];
    }
    return true;
}

/* Names and numbers for OpenImageIO; `compression` is the caller's memory. DateTime is fixed,
 * because the EXR writer would else put the time of day into the file. */
static void choose_options(const struct image_encode_desc *desc, int quality, char compression[32],
                           struct oiio_option options[OPTIONS_MAX])
{
    int count = 0;
    snprintf(compression, 32, "zip");
    if (desc->format == IMAGE_FORMAT_JPEG)
        snprintf(compression, 32, "jpeg:%d", quality);
    options[count++] = (struct oiio_option){.name = "Compression", .text = compression};
    if (desc->format == IMAGE_FORMAT_EXR) {
        options[count++] = (struct oiio_option){.name = "DateTime", .text = "1970:01:01 00:00:00"};
    } else {
        options[count++] = (struct oiio_option){.name = "oiio:UnassociatedAlpha", .number = 1};
        options[count++] = (struct oiio_option){.name = "oiio:ColorSpace", .text = "sRGB"};
    }
    if (desc->description)
        options[count++] =
            (struct oiio_option){.name = "ImageDescription", .text = desc->description};
    if (desc->provenance && desc->format == IMAGE_FORMAT_EXR)
        options[count++] =
            (struct oiio_option){.name = PROVENANCE_EXR_ATTRIBUTE, .text = desc->provenance};
    options[count] = (struct oiio_option){.name = NULL};
}

/* Puts an APP1 segment of XMP behind the JFIF header, which comes first (XMP part 3, 1.1.3). The
 * file is malloc'ed memory. */
static bool add_jpeg_xmp(const char *xmp, size_t xmp_bytes, void **bytes, size_t *size_bytes,
                         struct error *err)
{
    static const char name[] = "http://ns.adobe.com/xap/1.0/"; /* with its NUL */
    const uint8_t *file = *bytes;
    bool has_jfif = *size_bytes > 6 && file[2] == 0xff && file[3] == 0xe0;
    size_t at = has_jfif ? 4 + (size_t)(file[4] << 8 | file[5]) : 2;
    size_t length = 2 + sizeof name + xmp_bytes, added = 2 + length;
    uint8_t *grown = at <= *size_bytes ? malloc(*size_bytes + added) : NULL, *to = grown;
    if (!grown)
        return error_set(err, ERROR_NO_MEMORY, "jpeg of %zu bytes", *size_bytes + added);
    const uint8_t head[] = {0xff, 0xe1, (uint8_t)(length >> 8), (uint8_t)length};
    to = mempcpy(to, file, at);
    to = mempcpy(to, head, sizeof head);
    to = mempcpy(to, name, sizeof name);
    to = mempcpy(to, xmp, xmp_bytes);
    memcpy(to, file + at, *size_bytes - at);
    free(*bytes);
    *bytes = grown;
    *size_bytes += added;
    return true;
}

static bool encode_by_library(const struct image *image, const struct image_encode_desc *desc,
                              int quality, void **bytes, size_t *size_bytes, struct error *err)
{
    static const char *const oiio_names[IMAGE_FORMAT_COUNT] = {
        [IMAGE_FORMAT_JPEG] = "jpeg", [IMAGE_FORMAT_EXR] = "openexr"};
    char compression[32];
    struct oiio_option options[OPTIONS_MAX];
    choose_options(desc, quality, compression, options);
    const struct oiio_functions *library = image_library(err);
    return library &&
           library->encode(image, oiio_names[desc->format], options, bytes, size_bytes, err);
}

static bool encode(const struct image *image, const struct image_encode_desc *desc, void **bytes,
                   size_t *size_bytes, struct error *err)
{
    int quality = desc->quality ? desc->quality : QUALITY_DEFAULT;
    if (desc->format == IMAGE_FORMAT_PNG)
        return png_file_encode(image,
                               &(struct png_file_desc){.level = PNG_LEVEL,
                                                       .description = desc->description,
                                                       .provenance = desc->provenance},
                               bytes, size_bytes, err);
    char xmp[PROVENANCE_PACKET_MAX];
    size_t xmp_bytes = 0;
    bool has_xmp = desc->provenance && desc->format != IMAGE_FORMAT_EXR;
    if (has_xmp && !provenance_packet(desc->provenance, xmp, &xmp_bytes))
        return error_set(err, ERROR_INTERNAL, "the provenance is too long for XMP");
    if (desc->format == IMAGE_FORMAT_WEBP)
        return webp_encode(image,
                           &(struct webp_file_desc){.quality = quality,
                                                    .xmp = has_xmp ? xmp : NULL,
                                                    .xmp_bytes = xmp_bytes},
                           bytes, size_bytes, err);
    if (!encode_by_library(image, desc, quality, bytes, size_bytes, err))
        return false;
    if (!has_xmp || add_jpeg_xmp(xmp, xmp_bytes, bytes, size_bytes, err))
        return true;
    free(*bytes);
    *bytes = NULL;
    return false;
}

void image_warm_up(void)
{
    struct error ignored = {0}; /* reported to whoever needs the library */
    (void)image_library(&ignored);
}

bool image_encode(const struct image *image, const struct image_encode_desc *desc, void **bytes,
                  size_t *size_bytes, struct error *err)
{
    *bytes = NULL;
    *size_bytes = 0;
    if (!check(image, desc, err))
        return false;
    struct image converted = {.channels = 0};
    bool is_lossy = desc->format == IMAGE_FORMAT_JPEG || desc->format == IMAGE_FORMAT_WEBP;
    bool has_alpha = desc->format == IMAGE_FORMAT_WEBP && image->channels % 2 == 0;
    bool must_convert = is_lossy && image->channels != (has_alpha ? 4 : 3);
    if (must_convert && !convert_channels(image, has_alpha, &converted, err))
        return false;
    bool is_done = encode(must_convert ? &converted : image, desc, bytes, size_bytes, err);
    image_finish(&converted);
    return is_done;
}

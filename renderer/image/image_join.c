/* SPDX-License-Identifier: MIT */
/* Which formats and options joining takes; OpenImageIO does it. */
#include "renderer/image/image_join.h"

#include <stdio.h>

#include "renderer/image/image_library.h"

enum {
    SIDE_MAX_PX = 65536,      /* of OpenImageIO's PNG and EXR: tried */
    JPEG_SIDE_MAX_PX = 65500, /* libjpeg's JPEG_MAX_DIMENSION */
    QUALITY_DEFAULT = 90,
};

int image_join_side_max(enum image_format format)
{
    switch (format) {
    case IMAGE_FORMAT_PNG:
    case IMAGE_FORMAT_EXR:
        return SIDE_MAX_PX;
    case IMAGE_FORMAT_JPEG:
        return JPEG_SIDE_MAX_PX;
    default:
        return 0;
    }
}

bool image_join(const struct image_join_desc *desc, struct error *err)
{
    static const char *const names[IMAGE_FORMAT_COUNT] = {
        [IMAGE_FORMAT_PNG] = "png", [IMAGE_FORMAT_JPEG] = "jpeg", [IMAGE_FORMAT_EXR] = "openexr"};
    bool is_jpeg = desc->format == IMAGE_FORMAT_JPEG;
    const struct oiio_functions *library = image_library(err);
    char compression[32];
    snprintf(compression, sizeof compression, "jpeg:%d",
             desc->quality ? desc->quality : QUALITY_DEFAULT);
    const struct oiio_option of_jpeg[] = {{.name = "Compression", .text = compression},
                                          {.name = "oiio:ColorSpace", .text = "sRGB"},
                                          {.name = NULL}};
    const struct oiio_option of_png[] = {{.name = "oiio:UnassociatedAlpha", .number = 1},
                                         {.name = "oiio:ColorSpace", .text = "sRGB"},
                                         {.name = NULL}};
    const struct oiio_option of_exr[] = {{.name = "DateTime", .text = "1970:01:01 00:00:00"},
                                         {.name = NULL}};
    const struct oiio_join join = {
        .paths = desc->paths,
        .columns = desc->columns,
        .rows = desc->rows,
        .from = names[desc->format == IMAGE_FORMAT_EXR ? IMAGE_FORMAT_EXR : IMAGE_FORMAT_PNG],
        .to = names[desc->format],
        .options = is_jpeg                            ? of_jpeg
                   : desc->format == IMAGE_FORMAT_PNG ? of_png
                                                      : of_exr,
        .channels = is_jpeg ? 3 : 0,
        .fd = desc->fd};
    return library && library->join(&join, err);
}

/* SPDX-License-Identifier: MIT */
/* Which formats and options joining takes: OpenImageIO reads the tiles, and writes PNG and EXR. */
#include "renderer/image/image_join.h"

#include "protocol/provenance_file.h"
#include "renderer/image/image_library.h"
#include "renderer/image/jpeg_codec.h"

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

/* A JPEG under way. */
struct jpeg_picture {
    const struct image_join_desc *desc;
    struct jpeg_writer *writer;
};

static bool begin_jpeg(void *context, int width_px, int height_px, struct error *err)
{
    struct jpeg_picture *picture = context;
    const struct image_join_desc *desc = picture->desc;
    char xmp[PROVENANCE_PACKET_MAX];
    struct jpeg_file_desc file = {.quality = desc->quality ? desc->quality : QUALITY_DEFAULT,
                                  .description = desc->description};
    if (desc->provenance) {
        if (!provenance_packet(desc->provenance, xmp, &file.xmp_bytes))
            return error_set(err, ERROR_INTERNAL, "the provenance is too long for XMP");
        file.xmp = xmp;
    }
    picture->writer = jpeg_writer_create(desc->fd, width_px, height_px, &file, err);
    return picture->writer != NULL;
}

static bool put_jpeg(void *context, const void *rows, int row_count, struct error *err)
{
    const struct jpeg_picture *picture = context;
    return jpeg_writer_put(picture->writer, rows, row_count, err);
}

static bool join_as_jpeg(const struct image_join_desc *desc, struct oiio_join *join,
                         const struct oiio_functions *library, struct error *err)
{
    struct jpeg_picture picture = {.desc = desc};
    const struct oiio_rows rows = {&picture, begin_jpeg, put_jpeg};
    join->to_rows = &rows;
    bool is_good = library->join(join, err) && jpeg_writer_end(picture.writer, err);
    jpeg_writer_destroy(picture.writer);
    return is_good;
}

bool image_join(const struct image_join_desc *desc, struct error *err)
{
    const struct oiio_functions *library = image_library(err);
    const char *text = desc->provenance;
    const struct oiio_option of_png[] = {
        {.name = "oiio:UnassociatedAlpha", .number = 1},
        {.name = "oiio:ColorSpace", .text = "sRGB"},
        {.name = text ? PROVENANCE_PNG_KEYWORD : NULL, .text = text},
        {.name = NULL}};
    const struct oiio_option of_exr[] = {
        {.name = "DateTime", .text = "1970:01:01 00:00:00"},
        {.name = text ? PROVENANCE_EXR_ATTRIBUTE : NULL, .text = text},
        {.name = NULL}};
    bool is_exr = desc->format == IMAGE_FORMAT_EXR;
    struct oiio_join join = {.paths = desc->paths,
                             .columns = desc->columns,
                             .rows = desc->rows,
                             .from = is_exr ? "openexr" : "png",
                             .to = is_exr ? "openexr" : "png",
                             .options = is_exr ? of_exr : of_png,
                             .fd = desc->fd};
    if (!library)
        return false;
    return desc->format == IMAGE_FORMAT_JPEG ? join_as_jpeg(desc, &join, library, err)
                                             : library->join(&join, err);
}

/* SPDX-License-Identifier: MIT */
/* Which formats and options joining takes: OpenImageIO reads the tiles, and writes PNG and EXR. */
#include "renderer/image/image_join.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/provenance_file.h"
#include "renderer/base/file_write.h"
#include "renderer/image/image_library.h"
#include "renderer/image/jpeg_codec.h"
#include "renderer/image/webp_codec.h"

enum {
    SIDE_MAX_PX = 65536,      /* of OpenImageIO's PNG and EXR: tried */
    JPEG_SIDE_MAX_PX = 65500, /* libjpeg's JPEG_MAX_DIMENSION */
    WEBP_SIDE_MAX_PX = 16383, /* of the format */
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
    case IMAGE_FORMAT_WEBP:
        return WEBP_SIDE_MAX_PX;
    default:
        return 0;
    }
}

/* A JPEG under way. */
struct jpeg_picture {
    const struct image_join_desc *desc;
    struct jpeg_writer *writer;
};

static bool begin_jpeg(void *context, int width_px, int height_px, int channels, struct error *err)
{
    struct jpeg_picture *picture = context;
    (void)channels;
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
    const struct oiio_rows rows = {&picture, 3, begin_jpeg, put_jpeg};
    join->to_rows = &rows;
    bool is_good = library->join(join, err) && jpeg_writer_end(picture.writer, err);
    jpeg_writer_destroy(picture.writer);
    return is_good;
}

/* A WebP is compressed from the whole picture, which its format keeps below 1.1 GB. */
struct webp_picture {
    struct image image;
    int row_count; /* that it has */
};

static bool begin_webp(void *context, int width_px, int height_px, int channels, struct error *err)
{
    struct webp_picture *picture = context;
    return image_init(&picture->image, width_px, height_px, channels, IMAGE_U8, err);
}

static bool put_webp(void *context, const void *rows, int row_count, struct error *err)
{
    struct webp_picture *picture = context;
    size_t row_bytes = (size_t)picture->image.width_px * (size_t)picture->image.channels;
    (void)err;
    memcpy((char *)picture->image.pixels + (size_t)picture->row_count * row_bytes, rows,
           (size_t)row_count * row_bytes);
    picture->row_count += row_count;
    return true;
}

static bool join_as_webp(const struct image_join_desc *desc, struct oiio_join *join,
                         const struct oiio_functions *library, struct error *err)
{
    struct webp_picture picture = {.row_count = 0};
    const struct oiio_rows rows = {&picture, 0, begin_webp, put_webp};
    const struct image_encode_desc how = {
        .format = IMAGE_FORMAT_WEBP, .quality = desc->quality, .provenance = desc->provenance};
    void *bytes = NULL;
    size_t size_bytes;
    join->to_rows = &rows;
    bool is_good = library->join(join, err) &&
                   image_encode(&picture.image, &how, &bytes, &size_bytes, err) &&
                   (file_write_all(desc->fd, bytes, size_bytes) ||
                    error_set(err, ERROR_IO, "writing the picture: %s", strerror(errno)));
    free(bytes);
    image_finish(&picture.image);
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
    switch (desc->format) {
    case IMAGE_FORMAT_JPEG:
        return join_as_jpeg(desc, &join, library, err);
    case IMAGE_FORMAT_WEBP:
        return join_as_webp(desc, &join, library, err);
    default:
        return library->join(&join, err);
    }
}

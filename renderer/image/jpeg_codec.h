/* SPDX-License-Identifier: MIT */
/* JPEG through libjpeg-turbo itself, without OpenImageIO and its 250 libraries. Thread:
 * any.
 */
#ifndef VITRAIL_RENDERER_IMAGE_JPEG_CODEC_H
#define VITRAIL_RENDERER_IMAGE_JPEG_CODEC_H

#include "renderer/image/image.h"

struct jpeg_file_desc {
    int quality;             /* [1, 100] */
    const char *description; /* optional; a comment of at most 65,533 bytes */
    const char *xmp;         /* optional; a packet of xmp_bytes, at most 65,504 */
    size_t xmp_bytes;
};

/* image: U8, RGB or RGBA, whose alpha is left out; taken as sRGB. *bytes is malloc'ed. */
MUST_CHECK bool jpeg_file_encode(const struct image *image, const struct jpeg_file_desc *desc,
                                 void **bytes, size_t *size_bytes, struct error *err);

/* The same file, some rows at a time. The writer is one thread's at a time. */
struct jpeg_writer;

/* fd: where the file begins, borrowed until the writer is destroyed. desc is read here. NULL with
 * err set on failure. */
struct jpeg_writer *jpeg_writer_create(int fd, int width_px, int height_px,
                                       const struct jpeg_file_desc *desc, struct error *err);
/* The next rows, U8 RGB without gaps. ERROR_IO: the file cannot be written. */
MUST_CHECK bool jpeg_writer_put(struct jpeg_writer *writer, const void *rows, int row_count,
                                struct error *err);
/* After the last row. */
MUST_CHECK bool jpeg_writer_end(struct jpeg_writer *writer, struct error *err);
/* NULL does nothing. */
void jpeg_writer_destroy(struct jpeg_writer *writer);

/* Into *image (initialised here), U8 RGBA without transparency. Grey, YCbCr, RGB and CMYK are read
 * (the last two kinds of Adobe, inverted). Profiles and orientation are ignored, and data that end
 * early or are damaged leave the rest of the picture grey, as everywhere. */
MUST_CHECK bool jpeg_file_decode(const void *bytes, size_t size_bytes, struct image *image,
                                 struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* OpenImageIO as plain C: one named format, from memory to memory. The only home of OpenImageIO is
 * oiio_shim.cpp. Thread: any. No threads are started, and no file is opened that is not of memory.
 */
#ifndef VITRAIL_RENDERER_IMAGE_OIIO_SHIM_H
#define VITRAIL_RENDERER_IMAGE_OIIO_SHIM_H

#include <stdbool.h>
#include <stddef.h>

#include "protocol/error.h"
#include "renderer/image/deep_image.h"
#include "renderer/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

struct oiio_option {
    const char *name; /* NULL ends a list */
    const char *text; /* a string attribute, or NULL: `number` is meant */
    int number;
};

/* Takes the rows of a picture in the place of OpenImageIO: U8 without gaps. */
struct oiio_rows {
    void *context;
    int channels; /* 0: those of the tiles; 3: without their alpha */
    bool (*begin)(void *context, int width_px, int height_px, int channels, struct error *err);
    bool (*put)(void *context, const void *rows, int row_count, struct error *err);
};

/* Files of the tiles of one picture, all of one kind. */
struct oiio_join {
    const char *const *paths; /* columns * rows, row by row from the top */
    int columns, rows;
    const char *from;                  /* OpenImageIO's name of a format */
    const struct oiio_rows *to_rows;   /* optional; in the place of all below */
    const char *to;                    /* likewise a format */
    const struct oiio_option *options; /* of the picture's file, over what the first tile says */
    int fd;                            /* where it is written; borrowed */
};

struct oiio_functions {
    /* format: OpenImageIO's name, e.g. "openexr". The image's channels and component are written as
     * they are; *bytes is malloc'ed. */
    bool (*encode)(const struct image *image, const char *format, const struct oiio_option *options,
                   void **bytes, size_t *size_bytes, struct error *err);
    /* As OpenEXR of deep scanlines. */
    bool (*encode_deep)(const struct deep_image *image, const struct oiio_option *options,
                        void **bytes, size_t *size_bytes, struct error *err);
    /* Decodes the first subimage into *image (initialised here) with its own channels, U32 where
     * the file has such whole numbers, else F32. */
    bool (*decode)(const void *bytes, size_t size_bytes, const char *format, struct image *image,
                   struct error *err);
    /* Writes the picture, some rows at a time. ERROR_IO: it cannot be written; else a tile cannot
     * be read. */
    bool (*join)(const struct oiio_join *desc, struct error *err);
};

/* Exported by the module; others ask renderer/image/image_library.h. */
const struct oiio_functions *oiio_get_functions(void);

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: MIT */
/* Files of tiles made into the file of their picture, a few rows of pixels at a time, but for WebP,
 * which holds the whole picture. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_IMAGE_JOIN_H
#define VITRAIL_RENDERER_IMAGE_IMAGE_JOIN_H

#include "renderer/image/image.h"

/* How long a side of a picture of that format may be, px. 0: it cannot be joined. */
int image_join_side_max(enum image_format format);

struct image_join_desc {
    const char *const *paths; /* required; columns * rows files, row by row from the top */
    int columns, rows;
    enum image_format format; /* of the picture; its tiles are EXR for EXR, else PNG */
    int quality;              /* as in struct image_encode_desc */
    const char *description;  /* likewise, but of a JPEG alone: PNG and EXR say what tiles say */
    const char *provenance;   /* optional, borrowed; as in struct image_encode_desc */
    int fd;                   /* an empty file for the picture, borrowed */
};

/* ERROR_IO: the picture cannot be written; other errors: a tile cannot be read. */
MUST_CHECK bool image_join(const struct image_join_desc *desc, struct error *err);

#endif

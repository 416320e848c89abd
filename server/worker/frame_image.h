/* SPDX-License-Identifier: MIT */
/* From the outputs of a frame to the one image that a reply carries. Thread: any. */
#ifndef VITRAIL_SERVER_WORKER_FRAME_IMAGE_H
#define VITRAIL_SERVER_WORKER_FRAME_IMAGE_H

#include "protocol/error.h"
#include "protocol/render_request.h"
#include "renderer/image/image.h"
#include "renderer/renderer.h"

/* Builds the image for a format; it may take pixels out of the frame. What each output looks like
 * in each format is written down in docs/reference/http.md. */
MUST_CHECK bool frame_image_init(struct image *image, struct frame *frame,
                                 const struct render_request *request, enum image_format format,
                                 struct error *err);

#endif

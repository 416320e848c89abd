/* SPDX-License-Identifier: MIT */
/* The image formats that a request can be answered in. Thread: any; nothing here touches GL. */
#ifndef VITRAIL_SERVER_MAPPING_FORMAT_MAPPING_H
#define VITRAIL_SERVER_MAPPING_FORMAT_MAPPING_H

#include "protocol/render_request.h"
#include "renderer/image/image.h"

enum image_format image_format_from_request(const struct render_request *request); /* ANY: PNG */

/* The formats that can hold these outputs, as a bit set of 1u << enum image_format: several outputs
 * need EXR, and ids want a lossless one. */
unsigned frame_image_formats(uint32_t outputs);

#endif

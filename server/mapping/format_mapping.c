/* SPDX-License-Identifier: MIT */
/* Outputs decide which formats can hold them. */
#include "server/mapping/format_mapping.h"

#include "renderer/view.h"

enum image_format image_format_from_request(const struct render_request *request)
{
    switch (request->format) {
    case REQUEST_FORMAT_JPEG:
        return IMAGE_FORMAT_JPEG;
    case REQUEST_FORMAT_WEBP:
        return IMAGE_FORMAT_WEBP;
    case REQUEST_FORMAT_EXR:
    case REQUEST_FORMAT_EXR_DEEP:
        return IMAGE_FORMAT_EXR;
    case REQUEST_FORMAT_ANY:
    case REQUEST_FORMAT_PNG:
        break;
    }
    return IMAGE_FORMAT_PNG;
}

static const uint32_t ID_OUTPUTS = 1u << VIEW_OUTPUT_NODE | 1u << VIEW_OUTPUT_MATERIAL;

unsigned frame_image_formats(uint32_t outputs)
{
    if (outputs & (outputs - 1))
        return 1u << IMAGE_FORMAT_EXR;
    if (outputs & 1u << VIEW_OUTPUT_POSITION)
        return 1u << IMAGE_FORMAT_EXR; /* metres of any size have no place on a screen */
    if (outputs & ID_OUTPUTS)
        return 1u << IMAGE_FORMAT_PNG | 1u << IMAGE_FORMAT_EXR;
    return (1u << IMAGE_FORMAT_COUNT) - 1;
}

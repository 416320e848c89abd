/* SPDX-License-Identifier: MIT */
/* PNG images of GLB files, through libpng. */
#include "glb/png_encode.h"

#include <png.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"

static bool is_opaque(const uint8_t *rgba, size_t pixel_count)
{
    for (size_t i = 0; i < pixel_count; i++)
        if (rgba[4 * i + 3] != 255)
            return false;
    return true;
}

/* The pixels as RGB where all are opaque, as RGBA otherwise. NULL when memory is short. */
static uint8_t *pack(const uint8_t *rgba, size_t pixel_count, bool has_alpha)
{
    size_t channels = has_alpha ? 4 : 3;
    uint8_t *packed = malloc(pixel_count * channels);
    for (size_t i = 0; packed && i < pixel_count; i++)
        memcpy(packed + channels * i, rgba + 4 * i, channels);
    return packed;
}

bool png_encode(const uint8_t *rgba, int width_px, int height_px, void **png, size_t *size_bytes,
                struct error *err)
{
    *png = NULL;
    *size_bytes = 0;
    int side = LIMIT_IMAGE_SIDE_PX;
    if (!rgba || width_px < 1 || height_px < 1 || width_px > side || height_px > side)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "image of %d x %d pixels, sides must be in [1, %d]", width_px, height_px,
                         side);
    size_t pixel_count = (size_t)width_px * (size_t)height_px;
    bool has_alpha = !is_opaque(rgba, pixel_count);
    png_image image = {
        .version = PNG_IMAGE_VERSION,
        .width = (png_uint_32)width_px,
        .height = (png_uint_32)height_px,
        .format = has_alpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB,
    };
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    uint8_t *packed = pack(rgba, pixel_count, has_alpha);
    void *bytes = malloc(size);
    bool is_written = false;
    if (!packed || !bytes)
        error_set(err, ERROR_NO_MEMORY, "image of %d x %d pixels", width_px, height_px);
    else if (!png_image_write_to_memory(&image, bytes, &size, 0, packed, 0, NULL))
        error_set(err, ERROR_INTERNAL, "libpng: %s", image.message);
    else
        is_written = true;
    png_image_free(&image);
    free(packed);
    if (!is_written) {
        free(bytes);
        return false;
    }
    void *trimmed = realloc(bytes, size);
    *png = trimmed ? trimmed : bytes;
    *size_bytes = size;
    return true;
}

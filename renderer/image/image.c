/* SPDX-License-Identifier: MIT */
/* Image memory, and the table of formats. */
#include "renderer/image/image.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static size_t component_bytes(enum image_component component)
{
    static const size_t bytes[] = {
        [IMAGE_U8] = 1, [IMAGE_U16] = 2, [IMAGE_U32] = 4, [IMAGE_F32] = 4};
    return bytes[component];
}

size_t image_size_bytes(const struct image *image)
{
    return (size_t)image->width_px * (size_t)image->height_px * (size_t)image->channels *
           component_bytes(image->component);
}

bool image_init(struct image *image, int width_px, int height_px, int channels,
                enum image_component component, struct error *err)
{
    memset(image, 0, sizeof *image);
    if (width_px <= 0 || height_px <= 0 || channels <= 0 || channels > IMAGE_CHANNELS_MAX)
        return error_set(err, ERROR_INVALID_REQUEST, "an image of %d x %d with %d channels",
                         width_px, height_px, channels);
    size_t bytes;
    if (__builtin_mul_overflow((size_t)width_px, (size_t)height_px, &bytes) ||
        __builtin_mul_overflow(bytes, (size_t)channels * component_bytes(component), &bytes))
        return error_set(err, ERROR_TOO_LARGE, "an image of %d x %d", width_px, height_px);
    void *pixels = calloc(1, bytes);
    if (!pixels)
        return error_set(err, ERROR_NO_MEMORY, "an image of %d x %d", width_px, height_px);
    *image = (struct image){.width_px = width_px,
                            .height_px = height_px,
                            .channels = channels,
                            .component = component,
                            .pixels = pixels};
    return true;
}

void image_make_opaque_if_clear(struct image *image)
{
    size_t count = (size_t)image->width_px * (size_t)image->height_px;
    uint8_t *pixels = image->pixels;
    for (size_t i = 0; i < count; i++)
        if (pixels[4 * i + 3])
            return;
    for (size_t i = 0; i < count; i++)
        pixels[4 * i + 3] = 255;
}

void image_finish(struct image *image)
{
    free(image->pixels);
    memset(image, 0, sizeof *image);
}

struct format_row {
    const char *name, *alias, *media_type;
};

static const struct format_row formats[IMAGE_FORMAT_COUNT] = {
    [IMAGE_FORMAT_PNG] = {"png", "png", "image/png"},
    [IMAGE_FORMAT_JPEG] = {"jpeg", "jpg", "image/jpeg"},
    [IMAGE_FORMAT_WEBP] = {"webp", "webp", "image/webp"},
    [IMAGE_FORMAT_EXR] = {"exr", "openexr", "image/x-exr"},
};

const char *image_format_name(enum image_format format)
{
    return formats[format].name;
}

const char *image_format_media_type(enum image_format format)
{
    return formats[format].media_type;
}

bool image_format_from_name(const char *name, enum image_format *format)
{
    for (int i = 0; i < IMAGE_FORMAT_COUNT; i++)
        if (strcasecmp(name, formats[i].name) == 0 || strcasecmp(name, formats[i].alias) == 0) {
            *format = (enum image_format)i;
            return true;
        }
    return false;
}

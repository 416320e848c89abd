/* SPDX-License-Identifier: MIT */
/* Memory of deep images, and their way into OpenEXR. */
#include "renderer/image/deep_image.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/provenance_file.h"
#include "renderer/image/image_library.h"

bool deep_image_init(struct deep_image *image, int width_px, int height_px, struct error *err)
{
    *image = (struct deep_image){.width_px = width_px, .height_px = height_px};
    image->pixels = calloc((size_t)width_px * (size_t)height_px, sizeof *image->pixels);
    return image->pixels ||
           error_set(err, ERROR_NO_MEMORY, "a deep image of %d x %d", width_px, height_px);
}

bool deep_image_reserve(struct deep_image *image, size_t count, struct error *err)
{
    size_t wanted = image->count + count, grown = wanted + wanted / 2;
    if (wanted > DEEP_SAMPLES_MAX)
        return error_set(err, ERROR_TOO_LARGE,
                         "a deep image of more than %d samples: render it smaller, or in tiles",
                         DEEP_SAMPLES_MAX);
    if (wanted <= image->room)
        return true;
    struct deep_sample *samples = realloc(image->samples, grown * sizeof *samples);
    if (!samples)
        return error_set(err, ERROR_NO_MEMORY, "a deep image of %zu samples", wanted);
    image->samples = samples;
    image->room = grown;
    return true;
}

void deep_image_set(struct deep_image *image, int x_px, int y_px, const struct deep_sample *samples,
                    uint32_t count)
{
    assert(x_px >= 0 && x_px < image->width_px && y_px >= 0 && y_px < image->height_px);
    assert(count <= image->room - image->count);
    image->pixels[(size_t)y_px * (size_t)image->width_px + (size_t)x_px] =
        (struct deep_pixel){.first = image->count, .count = count};
    if (count)
        memcpy(image->samples + image->count, samples, count * sizeof *samples);
    image->count += count;
}

void deep_image_finish(struct deep_image *image)
{
    free(image->pixels);
    free(image->samples);
    *image = (struct deep_image){0};
}

bool deep_image_encode(const struct deep_image *image, const struct deep_encode_desc *desc,
                       void **bytes, size_t *size_bytes, struct error *err)
{
    struct oiio_option options[5];
    int count = 0;
    options[count++] = (struct oiio_option){.name = "Compression", .text = "zips"};
    options[count++] = (struct oiio_option){.name = "DateTime", .text = "1970:01:01 00:00:00"};
    if (desc->description)
        options[count++] =
            (struct oiio_option){.name = "ImageDescription", .text = desc->description};
    if (desc->provenance)
        options[count++] =
            (struct oiio_option){.name = PROVENANCE_EXR_ATTRIBUTE, .text = desc->provenance};
    options[count] = (struct oiio_option){.name = NULL};
    const struct oiio_functions *library = image_library(err);
    return library && library->encode_deep(image, options, bytes, size_bytes, err);
}

/* SPDX-License-Identifier: MIT */
/* Textures, samplers, and the images that evaluated textures use, each decoded once. */
#include <stdlib.h>
#include <string.h>

#include "renderer/image/image.h"
#include "renderer/scene/importer.h"

enum { /* glTF 2.0 specification 5.26: the numbers of OpenGL */
       NEAREST = 9728,
       LINEAR = 9729,
       NEAREST_MIPMAP_NEAREST = 9984,
       LINEAR_MIPMAP_LINEAR = 9987,
       CLAMP_TO_EDGE = 33071,
       MIRRORED_REPEAT = 33648,
       REPEAT = 10497,
};

static bool is_wrap(int wrap)
{
    return wrap == CLAMP_TO_EDGE || wrap == MIRRORED_REPEAT || wrap == REPEAT;
}

static bool import_sampler(const struct gltf_document *document, int index,
                           struct scene_texture *to, struct error *err)
{
    to->mag_filter = LINEAR;
    to->min_filter = LINEAR_MIPMAP_LINEAR;
    to->wrap_s = to->wrap_t = REPEAT;
    if (index == -1)
        return true;
    if (index < 0 || (size_t)index >= document->sampler_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no sampler %d", index);
    const struct gltf_sampler *from = &document->samplers[index];
    int mag = from->mag_filter, min = from->min_filter;
    if ((mag != -1 && mag != NEAREST && mag != LINEAR) ||
        (min != -1 && min != NEAREST && min != LINEAR &&
         (min < NEAREST_MIPMAP_NEAREST || min > LINEAR_MIPMAP_LINEAR)))
        return error_set(err, ERROR_INVALID_SCENE, "sampler %d: unknown filter %d or %d", index,
                         mag, min);
    if (!is_wrap(from->wrap_s) || !is_wrap(from->wrap_t))
        return error_set(err, ERROR_INVALID_SCENE, "sampler %d: unknown wrap %d or %d", index,
                         from->wrap_s, from->wrap_t);
    if (mag != -1)
        to->mag_filter = (uint32_t)mag;
    if (min != -1)
        to->min_filter = (uint32_t)min;
    to->wrap_s = (uint32_t)from->wrap_s;
    to->wrap_t = (uint32_t)from->wrap_t;
    return true;
}

/* The encoded bytes of an image, from its URI or buffer view. */
static bool open_image(const struct importer *importer, size_t index, struct gltf_bytes *bytes,
                       struct error *err)
{
    const struct gltf_source *source = &importer->json.images[index];
    memset(bytes, 0, sizeof *bytes);
    if (source->uri && source->buffer_view >= 0)
        return error_set(err, ERROR_INVALID_SCENE, "both uri and bufferView are given");
    if (source->uri)
        return gltf_package_resolve(&importer->package, source->uri, bytes, err);
    if (source->buffer_view < 0)
        return error_set(err, ERROR_INVALID_SCENE, "neither uri nor bufferView is given");
    uint64_t size;
    if (!accessor_view_bytes(&importer->source, (int)source->buffer_view, "its data", &bytes->bytes,
                             &size, err))
        return false;
    bytes->size_bytes = size;
    return true;
}

static bool append_image(struct importer *importer, const struct image *image, const char *name,
                         struct error *err)
{
    uint64_t offset = importer->writer.sections[SCENE_PIXELS].count;
    size_t size = image_size_bytes(image);
    uint32_t text;
    void *pixels = blob_writer_append(&importer->writer, SCENE_PIXELS, size, err);
    if (!pixels || !blob_writer_add_text(&importer->writer, name, &text, err))
        return false;
    memcpy(pixels, image->pixels, size);
    struct scene_image *record = blob_writer_append(&importer->writer, SCENE_IMAGES, 1, err);
    if (!record)
        return false;
    *record = (struct scene_image){.width_px = (uint32_t)image->width_px,
                                   .height_px = (uint32_t)image->height_px,
                                   .offset_bytes = offset,
                                   .name = text};
    return true;
}

static bool decode(struct importer *importer, size_t index, const char *name, struct error *err)
{
    struct gltf_bytes bytes;
    struct image image = {.width_px = 0};
    struct image_decode_desc desc = {.max_pixels = importer->max_image_pixels};
    bool is_done = open_image(importer, index, &bytes, err) &&
                   image_decode(bytes.bytes, bytes.size_bytes, &desc, &image, err) &&
                   append_image(importer, &image, name, err);
    image_finish(&image);
    free(bytes.owned);
    return is_done;
}

/* Blob index of an image, decoding it the first time; decoded holds -1 for those not yet seen. */
static bool import_image(struct importer *importer, int index, int32_t *decoded,
                         int32_t *blob_index, struct error *err)
{
    if (index < 0 || (size_t)index >= importer->json.image_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no image %d", index);
    if (decoded[index] < 0) {
        const struct gltf_source *source = &importer->json.images[index];
        bool is_file = source->uri && strncmp(source->uri, "data:", 5) != 0;
        const char *name = source->name ? source->name : is_file ? source->uri : "";
        if (!decode(importer, (size_t)index, name, err))
            return error_wrap(err, "image %d '%s'", index, name);
        decoded[index] = (int32_t)importer->writer.sections[SCENE_IMAGES].count - 1;
    }
    *blob_index = decoded[index];
    return true;
}

static bool import_texture(struct importer *importer, size_t index, int32_t *decoded,
                           struct error *err)
{
    const struct gltf_texture *from = &importer->document->textures[index];
    struct scene_texture texture = {.image = -1};
    if (!import_sampler(importer->document, from->sampler, &texture, err) ||
        !blob_writer_add_text(&importer->writer, from->name, &texture.name, err))
        return false;
    if (importer->is_texture_used[index]) {
        if (from->image != -1) {
            if (!import_image(importer, from->image, decoded, &texture.image, err))
                return false;
        } else if (!importer_warn(
                       importer, err,
                       "texture %zu has no image in a format that is read here; white is used",
                       index)) {
            return false;
        }
    }
    struct scene_texture *record = blob_writer_append(&importer->writer, SCENE_TEXTURES, 1, err);
    if (!record)
        return false;
    *record = texture;
    return true;
}

bool import_textures(struct importer *importer, struct error *err)
{
    size_t count = importer->json.image_count;
    int32_t *decoded = malloc((count + 1) * sizeof *decoded);
    if (!decoded)
        return error_set(err, ERROR_NO_MEMORY, "%zu images", count);
    for (size_t i = 0; i < count; i++)
        decoded[i] = -1;
    bool is_done = true;
    for (size_t i = 0; is_done && i < importer->document->texture_count; i++)
        is_done = import_texture(importer, i, decoded, err);
    free(decoded);
    return is_done;
}

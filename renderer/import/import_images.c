/* SPDX-License-Identifier: MIT */
/* Textures, samplers, and the images that evaluated textures use, each once: the layout of a blob
 * follows from their headers, so pixels come last (import_pixels.c). */
#include <stdlib.h>
#include <string.h>

#include "renderer/image/image_header.h"
#include "renderer/import/importer.h"
#include "renderer/scene/scene.h"
#include "renderer/scene/texture_levels.h"

/* GlTF 2.0 specification 5.26: the numbers of OpenGL. */
enum {
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

bool import_open_image(const struct importer *importer, size_t index, struct gltf_bytes *bytes,
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

/* Takes the room that its header asks for; 0 is no offset of a level above the first. */
static bool append_image(struct importer *importer, size_t index, const char *name,
                         struct error *err)
{
    struct gltf_bytes bytes;
    struct image_header header;
    struct scene_image image = {.name = 0};
    bool is_good = import_open_image(importer, index, &bytes, err) &&
                   (importer->takes_old_images
                        ? image_header_read_old(&header, bytes.bytes, bytes.size_bytes, err)
                        : image_header_read(&header, bytes.bytes, bytes.size_bytes, err));
    free(bytes.owned);
    if (!is_good)
        return false;
    uint64_t pixels = (uint64_t)header.width_px * header.height_px;
    if (pixels == 0 || pixels > importer->max_image_pixels)
        return error_set(err, pixels ? ERROR_TOO_LARGE : ERROR_INVALID_SCENE,
                         "the image is %u x %u, limit is %llu pixels", header.width_px,
                         header.height_px, (unsigned long long)importer->max_image_pixels);
    image.width_px = header.width_px;
    image.height_px = header.height_px;
    struct scene_image *record;
    if (!blob_writer_reserve_pixels(&importer->writer, 4 * pixels, &image.offset_bytes, err) ||
        !blob_writer_add_text(&importer->writer, name, &image.name, err) ||
        !(record = blob_writer_append(&importer->writer, SCENE_IMAGES, 1, err)))
        return false;
    *record = image;
    importer->image_source[importer->writer.sections[SCENE_IMAGES].count - 1] = (uint32_t)index;
    return true;
}

/* Room for the levels of the images, in each way that materials sample them. */
static bool reserve_levels(struct importer *importer, struct error *err)
{
    struct blob_section *sections = importer->writer.sections;
    const struct scene_material *materials = sections[SCENE_MATERIALS].records;
    const struct scene_texture *textures = sections[SCENE_TEXTURES].records;
    struct scene_image *images = sections[SCENE_IMAGES].records;
    for (uint64_t i = 0; i < sections[SCENE_MATERIALS].count; i++)
        for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
            int32_t texture = materials[i].textures[slot].texture;
            if (texture < 0 || textures[texture].image < 0)
                continue;
            struct scene_image *image = &images[textures[texture].image];
            uint64_t *offset = &image->levels_offset_bytes[scene_slot_is_srgb(slot)];
            uint64_t size = texture_levels_bytes(image->width_px, image->height_px, 1);
            if (size && !*offset &&
                !blob_writer_reserve_pixels(&importer->writer, size, offset, err))
                return false;
        }
    return true;
}

/* Blob index of an image, listing it the first time; `listed` holds -1 for those not yet seen. */
static bool import_image(struct importer *importer, int index, int32_t *listed, int32_t *blob_index,
                         struct error *err)
{
    if (index < 0 || (size_t)index >= importer->json.image_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no image %d", index);
    if (listed[index] < 0) {
        const struct gltf_source *source = &importer->json.images[index];
        bool is_file = source->uri && strncmp(source->uri, "data:", 5) != 0;
        const char *name = source->name ? source->name : is_file ? source->uri : "";
        if (!append_image(importer, (size_t)index, name, err))
            return error_wrap(err, "image %d '%s'", index, name);
        listed[index] = (int32_t)importer->writer.sections[SCENE_IMAGES].count - 1;
    }
    *blob_index = listed[index];
    return true;
}

static bool is_required(const struct gltf_document *document, const char *extension)
{
    for (size_t i = 0; i < document->extension_required_count; i++)
        if (strcmp(document->extensions_required[i], extension) == 0)
            return true;
    return false;
}

/* A texture without an image in a format that is read here. */
static bool tell_missing(struct importer *importer, size_t index, struct error *err)
{
    const struct gltf_document *document = importer->document;
    if (!document->textures[index].is_basisu)
        return importer_warn(
            importer, err, "texture %zu has no image in a format that is read here; white is used",
            index);
    if (is_required(document, "KHR_texture_basisu"))
        return error_set(err, ERROR_UNSUPPORTED,
                         "texture %zu is there only as KTX2 with Basis Universal "
                         "(KHR_texture_basisu), which is not read; PNG, JPEG and WebP are",
                         index);
    return importer_warn(importer, err,
                         "texture %zu is there only as KTX2 with Basis Universal, which is not "
                         "read; white is used",
                         index);
}

static bool import_texture(struct importer *importer, size_t index, int32_t *listed,
                           struct error *err)
{
    const struct gltf_texture *from = &importer->document->textures[index];
    struct scene_texture texture = {.image = -1};
    if (!import_sampler(importer->document, from->sampler, &texture, err) ||
        !blob_writer_add_text(&importer->writer, from->name, &texture.name, err))
        return false;
    if (importer->is_texture_used[index]) {
        if (from->image != -1) {
            if (!import_image(importer, from->image, listed, &texture.image, err))
                return false;
        } else if (!tell_missing(importer, index, err)) {
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
    int32_t *listed = malloc((count + 1) * sizeof *listed);
    importer->image_source = calloc(count + 1, sizeof *importer->image_source);
    bool is_done = listed && importer->image_source;
    if (!is_done)
        error_set(err, ERROR_NO_MEMORY, "%zu images", count);
    for (size_t i = 0; is_done && i < count; i++)
        listed[i] = -1;
    for (size_t i = 0; is_done && i < importer->document->texture_count; i++)
        is_done = import_texture(importer, i, listed, err) || error_wrap(err, "texture %zu", i);
    free(listed);
    return is_done && reserve_levels(importer, err);
}

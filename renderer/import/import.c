/* SPDX-License-Identifier: MIT */
/* scene_import: the order of an import, its extensions and its warnings. */
#include "renderer/import/import.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/converter.h"
#include "renderer/import/extensions.h"
#include "renderer/import/gltf_indices.h"
#include "renderer/import/importer.h"
#include "renderer/scene/scene.h"

#define BLOB_BYTES_DEFAULT (8ull << 30)
#define IMAGE_PIXELS_DEFAULT (64ull << 20)
#define RANGE_TOLERANCE 1e-6 /* factors written through f32 may miss 0 or 1 by so much */

static bool is_known(const char *extension)
{
    for (const char *const *at = scene_import_extensions(); *at; at++)
        if (strcmp(*at, extension) == 0)
            return true;
    return false;
}

bool importer_warn(struct importer *importer, struct error *err, const char *format, ...)
{
    char text[400];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return blob_writer_add_line(&importer->writer, SCENE_WARNINGS, text, err);
}

static void advance(const struct scene_import_desc *desc, enum scene_import_stage stage,
                    double share)
{
    if (desc->advance)
        desc->advance(desc->context, stage, share);
}

void importer_advance(const struct importer *importer, enum scene_import_stage stage, uint64_t done,
                      uint64_t total)
{
    advance(importer->desc, stage, total ? (double)done / (double)total : 1);
}

bool import_number(double number, double low, double high, float *out, const char *what,
                   struct error *err)
{
    if (!(number >= low - RANGE_TOLERANCE && number <= high + RANGE_TOLERANCE) ||
        !isfinite((float)number))
        return error_set(err, ERROR_INVALID_SCENE, "%s is %g, not in [%g, %g]", what, number, low,
                         high);
    *out = (float)fmin(fmax(number, low), high);
    return true;
}

bool import_numbers(struct gltf_numbers numbers, size_t count, double low, double high, float *out,
                    const char *what, struct error *err)
{
    if (numbers.count == 0)
        return true;
    if (numbers.count != count)
        return error_set(err, ERROR_INVALID_SCENE, "%s has %zu numbers, not %zu", what,
                         numbers.count, count);
    for (size_t i = 0; i < count; i++)
        if (!import_number(numbers.values[i], low, high, &out[i], what, err))
            return false;
    return true;
}

/* A buffer without URI is the BIN chunk if it is the first (specification 4.4.3.1), else it has no
 * bytes of its own, as fallback buffers of compression extensions: an error only where something
 * reads it. */
static bool open_buffer(struct importer *importer, size_t index, struct error *err)
{
    const struct gltf_source *source = &importer->json.buffers[index];
    struct gltf_bytes *bytes = &importer->buffers[index];
    if (source->uri) {
        if (!gltf_package_resolve(&importer->package, source->uri, bytes, err))
            return error_wrap(err, "buffer %zu", index);
    } else if (index == 0) {
        bytes->bytes = importer->package.bin;
        bytes->size_bytes = importer->package.bin_length;
    }
    if (bytes->bytes && source->byte_length > bytes->size_bytes)
        return error_set(err, ERROR_INVALID_SCENE,
                         "buffer %zu: byteLength is %llu, its data has %zu bytes", index,
                         (unsigned long long)source->byte_length, bytes->size_bytes);
    bytes->size_bytes = source->byte_length;
    return true;
}

static bool open_buffers(struct importer *importer, struct error *err)
{
    size_t views = importer->document->view_count;
    importer->buffers = calloc(importer->json.buffer_count + 1, sizeof *importer->buffers);
    importer->decoded = calloc(views + 1, sizeof *importer->decoded);
    if (!importer->buffers || !importer->decoded)
        return error_set(err, ERROR_NO_MEMORY, "%zu buffers and %zu views of them",
                         importer->json.buffer_count, views);
    for (size_t i = 0; i < importer->json.buffer_count; i++)
        if (!open_buffer(importer, i, err))
            return false;
    importer->source = (struct accessor_source){.document = importer->document,
                                                .buffers = importer->buffers,
                                                .buffer_count = importer->json.buffer_count,
                                                .decoded = importer->decoded,
                                                .decodable_bytes = &importer->decodable_bytes};
    return true;
}

static bool open_document(struct importer *importer, const struct scene_import_desc *desc,
                          struct error *err)
{
    if (!gltf_package_init(&importer->package, desc->files, desc->file_count, err) ||
        !gltf_json_init(&importer->json, importer->package.json, importer->package.json_length,
                        err))
        return false;
    struct gltf_indices_list indices = {.values = NULL};
    if (gltf_indices_take(&indices, &importer->json, err))
        importer->document = gltf_document_create(importer->json.rest, importer->json.rest_length,
                                                  scene_import_passed_extensions(), err);
    if (importer->document)
        gltf_document_put_indices(importer->document,
                                  (struct gltf_indices){indices.values, indices.count});
    gltf_indices_finish(&indices);
    if (!importer->document)
        return false;
    free(importer->json.rest);
    importer->json.rest = NULL;
    return open_buffers(importer, err);
}

static bool list_extensions(struct importer *importer, struct error *err)
{
    const struct gltf_document *document = importer->document;
    for (size_t i = 0; i < document->extension_used_count; i++) {
        const char *name = document->extensions_used[i];
        if (!blob_writer_add_line(&importer->writer, SCENE_EXTENSIONS_USED, name, err))
            return false;
        if (is_known(name))
            continue;
        if (!blob_writer_add_line(&importer->writer, SCENE_EXTENSIONS_IGNORED, name, err) ||
            !importer_warn(importer, err, "the extension %s is not evaluated", name))
            return false;
    }
    return true;
}

static bool warn_count(struct importer *importer, uint64_t count, const char *one, const char *many,
                       const char *rest, struct error *err)
{
    return count == 0 || importer_warn(importer, err, "%llu %s %s", (unsigned long long)count,
                                       count == 1 ? one : many, rest);
}

static bool list_warnings(struct importer *importer, struct error *err)
{
    return warn_count(importer, importer->unmoved_channels, "animation channel",
                      "animation channels",
                      "not evaluated: their targets are none that can move here", err) &&
           warn_count(importer, importer->unjointed_primitives, "primitive", "primitives",
                      "of skinned nodes without JOINTS_0 and WEIGHTS_0: they follow no joint",
                      err) &&
           warn_count(importer, importer->unbound_vertices, "vertex", "vertices",
                      "without a joint weight: they follow the first joint", err) &&
           warn_count(importer, importer->left_out_influences, "primitive", "primitives",
                      "with more than eight joints for a vertex: JOINTS_2 and above are left out",
                      err) &&
           warn_count(importer, importer->skinned_instances, "node", "nodes",
                      "with a skin and instances; one of each is shown", err) &&
           warn_count(importer, importer->undirected_primitives, "primitive", "primitives",
                      "with an anisotropic material but neither tangents nor the texture "
                      "coordinates that it asks for: reflected alike in all directions",
                      err) &&
           warn_count(importer, importer->degenerate_triangles, "triangle", "triangles",
                      "of zero area left out", err) &&
           warn_count(importer, importer->repaired_normals, "normal", "normals",
                      "of zero length replaced by that of the surface", err) &&
           warn_count(importer, importer->clamped_colors, "vertex colour", "vertex colours",
                      "clamped to [0, 1]", err) &&
           warn_count(importer, importer->missing_texcoords, "primitive", "primitives",
                      "without the texture coordinates that the material asks for; (0, 0) is used",
                      err) &&
           warn_count(importer, importer->far_texcoords, "texture", "textures",
                      "left out: only TEXCOORD_0 and TEXCOORD_1 are read", err) &&
           warn_count(importer, importer->open_volumes, "primitive", "primitives",
                      "with an attenuating volume but no closed surface that faces outward: the "
                      "thickness of the material is used instead of the way through it",
                      err);
}

/* Those of the converter come first. */
static bool list_lines(struct importer *importer, const char *lines, struct error *err)
{
    for (const char *at = lines; at && *at;) {
        int length = (int)strcspn(at, "\n");
        if (!importer_warn(importer, err, "%.*s", length, at))
            return false;
        at += length + (at[length] != '\0');
    }
    return true;
}

static bool begin_pixels(struct importer *importer, struct error *err)
{
    if (!importer->writer.sections[SCENE_IMAGES].count)
        return true;
    importer->pixels = import_pixels_begin(importer, err);
    return importer->pixels != NULL;
}

static bool import_all(struct importer *importer, const struct scene_import_desc *desc,
                       const char *warnings, struct error *err)
{
    uint64_t max_bytes = desc->max_blob_bytes ? desc->max_blob_bytes : BLOB_BYTES_DEFAULT;
    importer->max_image_pixels =
        desc->max_image_pixels ? desc->max_image_pixels : IMAGE_PIXELS_DEFAULT;
    importer->takes_old_images = desc->format != SCENE_FORMAT_GLTF;
    importer->decodable_bytes = max_bytes;
    if (!blob_writer_init(&importer->writer, max_bytes, err) || !open_document(importer, desc, err))
        return false;
    return list_lines(importer, warnings, err) && list_extensions(importer, err) &&
           import_materials(importer, err) && import_variants(importer, err) &&
           import_textures(importer, err) && begin_pixels(importer, err) &&
           import_lights(importer, err) && import_cameras(importer, err) &&
           import_grids(importer, err) && import_hierarchy(importer, err) &&
           import_meshes(importer, err) && import_nodes(importer, err) &&
           import_skins(importer, err) && import_animations(importer, err) &&
           list_warnings(importer, err);
}

static void importer_finish(struct importer *importer)
{
    import_pixels_destroy(importer->pixels); /* reads the rest */
    blob_writer_finish(&importer->writer);
    importer_free_scratch(importer->scratch);
    for (size_t i = 0; importer->buffers && i < importer->json.buffer_count; i++)
        free(importer->buffers[i].owned);
    free(importer->buffers);
    for (size_t i = 0; importer->decoded && i < importer->document->view_count; i++)
        free(importer->decoded[i].owned);
    free(importer->decoded);
    gltf_document_destroy(importer->document);
    gltf_json_finish(&importer->json);
    free(importer->mesh_of);
    free(importer->is_mesh_skinned);
    free(importer->is_texture_used);
    free(importer->image_source);
    free(importer->node_order);
}

static bool check_desc(const struct scene_import_desc *desc, struct error *err)
{
    if (desc->file_count == 0)
        return error_set(err, ERROR_INVALID_SCENE, "no file was uploaded");
    for (size_t i = 0; i < desc->file_count; i++)
        if (!desc->files[i].name || (!desc->files[i].bytes && desc->files[i].size_bytes))
            return error_set(err, ERROR_INTERNAL, "file %zu of the upload has no name or bytes", i);
    return true;
}

/* Of an upload that is glTF, or has become it. */
static bool import_gltf(const struct scene_import_desc *desc, const char *warnings, void **blob,
                        size_t *size_bytes, struct error *err)
{
    struct importer importer = {.desc = desc};
    advance(desc, SCENE_IMPORT_FILE, 0);
    bool is_done = import_all(&importer, desc, warnings, err) &&
                   blob_writer_write(&importer.writer, &importer.header, desc->write != NULL, blob,
                                     size_bytes, err) &&
                   (!importer.pixels || import_pixels_end(importer.pixels, *blob, err));
    importer_finish(&importer);
    struct scene scene; /* the worker will ask the same: what it would refuse is refused here */
    is_done = is_done &&
              (desc->write ? scene_open_head : scene_open)(&scene, *blob, *size_bytes, err) &&
              import_rest_bounds(*blob, &scene, err);
    if (is_done)
        return true;
    free(*blob);
    *blob = NULL;
    *size_bytes = 0;
    return false;
}

static bool tell_origin(const struct scene_import_desc *desc, const struct scene_origin *origin,
                        struct error *err)
{
    return !desc->tell_origin || desc->tell_origin(desc->context, origin, err);
}

static bool import_converted(const struct scene_import_desc *desc, void **blob, size_t *size_bytes,
                             struct error *err)
{
    struct conversion conversion = {0};
    struct scene_import_desc gltf = *desc;
    advance(desc, SCENE_IMPORT_CONVERSION, 0);
    bool is_done = conversion_init(&conversion, desc, err);
    gltf.files = conversion.files;
    gltf.file_count = conversion.file_count;
    is_done = is_done && tell_origin(desc, &conversion.output.origin, err) &&
              import_gltf(&gltf, conversion.output.warnings, blob, size_bytes, err);
    conversion_finish(&conversion);
    return is_done || error_wrap(err, "%s", scene_format_describe(desc->format)->title);
}

bool scene_import(const struct scene_import_desc *desc, void **blob, size_t *size_bytes,
                  struct error *err)
{
    const struct scene_origin origin = {
        .unit_m = 1, .up = 'y', .unit_by = SCENE_WORD_FILE, .up_by = SCENE_WORD_FILE};
    *blob = NULL;
    *size_bytes = 0;
    if (!check_desc(desc, err))
        return false;
    if (desc->format != SCENE_FORMAT_GLTF)
        return import_converted(desc, blob, size_bytes, err);
    return tell_origin(desc, &origin, err) && import_gltf(desc, NULL, blob, size_bytes, err);
}

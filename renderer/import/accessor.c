/* SPDX-License-Identifier: MIT */
/* Bounds of accessors, buffer views and sparse parts, and the reading of their elements. */
#include "renderer/import/accessor.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/meshopt_stream.h"

enum {
    ZEROED_ELEMENTS_MAX = 16 << 20
}; /* of an accessor without bytes: a few characters of JSON ask for them */

static size_t component_bytes(int component)
{
    switch (component) {
    case GLTF_BYTE:
    case GLTF_UNSIGNED_BYTE:
        return 1;
    case GLTF_SHORT:
    case GLTF_UNSIGNED_SHORT:
        return 2;
    case GLTF_UNSIGNED_INT:
    case GLTF_FLOAT:
        return 4;
    default:
        return 0;
    }
}

/* Where bytes of a buffer lie. */
static bool find_range(const struct accessor_source *source, int index, uint64_t offset,
                       uint64_t length, const uint8_t **bytes, struct error *err)
{
    if (index < 0 || (size_t)index >= source->buffer_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no buffer %d", index);
    const struct gltf_bytes *buffer = &source->buffers[index];
    if (!buffer->bytes)
        return error_set(err, ERROR_INVALID_SCENE, "buffer %d has no data", index);
    if (offset > buffer->size_bytes || length > buffer->size_bytes - offset)
        return error_set(err, ERROR_INVALID_SCENE, "bytes %llu + %llu lie outside buffer %d of %zu",
                         (unsigned long long)offset, (unsigned long long)length, index,
                         buffer->size_bytes);
    *bytes = buffer->bytes + offset;
    return true;
}

static bool open_stream(const struct accessor_source *source, const struct gltf_buffer_view *view,
                        struct meshopt_stream *stream, struct error *err)
{
    const struct gltf_meshopt *from = &view->meshopt;
    if (from->byte_offset < 0 || from->byte_length < 1)
        return error_set(err, ERROR_INVALID_SCENE, "byteOffset %d or byteLength %d is no size",
                         from->byte_offset, from->byte_length);
    if (view->byte_stride && view->byte_stride != (uint64_t)from->byte_stride)
        return error_set(err, ERROR_INVALID_SCENE, "byteStride is %d, that of the view is %llu",
                         from->byte_stride, (unsigned long long)view->byte_stride);
    stream->size_bytes = (size_t)from->byte_length;
    return find_range(source, from->buffer, (uint64_t)from->byte_offset, stream->size_bytes,
                      &stream->bytes, err) &&
           meshopt_stream_init(stream, from, err);
}

/* Fills `decoded`, which owns the bytes. */
static bool decode_view(const struct accessor_source *source, const struct gltf_buffer_view *view,
                        struct gltf_bytes *decoded, struct error *err)
{
    struct meshopt_stream stream = {.bytes = NULL};
    if (!open_stream(source, view, &stream, err))
        return false;
    uint64_t size = stream.decoded_bytes;
    if (view->byte_length > size)
        return error_set(err, ERROR_INVALID_SCENE,
                         "count and byteStride make %llu bytes, the view has %llu",
                         (unsigned long long)size, (unsigned long long)view->byte_length);
    if (size > *source->decodable_bytes)
        return error_set(err, ERROR_TOO_LARGE, "%llu decoded bytes, %llu are left of the limit",
                         (unsigned long long)size, (unsigned long long)*source->decodable_bytes);
    void *bytes = malloc(size);
    if (!bytes)
        return error_set(err, ERROR_NO_MEMORY, "%llu decoded bytes", (unsigned long long)size);
    if (!meshopt_stream_decode(&stream, bytes, err)) {
        free(bytes);
        return false;
    }
    *source->decodable_bytes -= size;
    *decoded = (struct gltf_bytes){.bytes = bytes, .size_bytes = size, .owned = bytes};
    return true;
}

/* The fallback buffer is read where it has data and the stream is newer than the library. */
static bool view_is_decoded(const struct accessor_source *source, int index, struct error *err)
{
    const struct gltf_buffer_view *view = &source->document->views[index];
    struct error problem = {0};
    if (!view->meshopt.extension)
        return false;
    if (source->decoded[index].bytes ||
        decode_view(source, view, &source->decoded[index], &problem))
        return true;
    bool has_fallback = view->buffer >= 0 && (size_t)view->buffer < source->buffer_count &&
                        source->buffers[view->buffer].bytes;
    if (problem.code != ERROR_UNSUPPORTED || !has_fallback)
        error_set(err, problem.code, "%s: %s", view->meshopt.extension, problem.message);
    return false;
}

bool accessor_view_bytes(const struct accessor_source *source, int index, const char *who,
                         const uint8_t **bytes, uint64_t *size_bytes, struct error *err)
{
    if (index < 0 || (size_t)index >= source->document->view_count)
        return error_set(err, ERROR_INVALID_SCENE, "%s: there is no buffer view %d", who, index);
    const struct gltf_buffer_view *view = &source->document->views[index];
    struct error problem = {0};
    if (view_is_decoded(source, index, &problem)) {
        *bytes = source->decoded[index].bytes;
        *size_bytes = source->decoded[index].size_bytes;
        return true;
    }
    *size_bytes = view->byte_length;
    if (problem.code == ERROR_NONE &&
        find_range(source, view->buffer, view->byte_offset, view->byte_length, bytes, &problem))
        return true;
    return error_set(err, problem.code, "buffer view %d: %s", index, problem.message);
}

/* Checks that `count` elements, `stride` apart from `offset` on, lie in the view; *first is where
 * they begin. */
static bool open_range(const struct accessor_source *source, int accessor, int view,
                       uint64_t offset, uint64_t count, size_t stride, size_t element_bytes,
                       const uint8_t **first, struct error *err)
{
    char who[32];
    const uint8_t *bytes = NULL;
    uint64_t size = 0;
    snprintf(who, sizeof who, "accessor %d", accessor);
    if (!accessor_view_bytes(source, view, who, &bytes, &size, err))
        return false;
    if (stride < element_bytes)
        return error_set(err, ERROR_INVALID_SCENE,
                         "%s: stride %zu is less than its element of %zu bytes", who, stride,
                         element_bytes);
    if (offset > size || element_bytes > size - offset ||
        (count - 1) > (size - offset - element_bytes) / stride)
        return error_set(err, ERROR_INVALID_SCENE,
                         "%s: %llu elements from byte %llu do not fit buffer view %d of %llu", who,
                         (unsigned long long)count, (unsigned long long)offset, view,
                         (unsigned long long)size);
    *first = bytes + offset;
    return true;
}

static uint32_t read_unsigned(const uint8_t *at, enum gltf_component component)
{
    uint16_t u16;
    uint32_t u32;
    switch (component) {
    case GLTF_UNSIGNED_BYTE:
        return *at;
    case GLTF_UNSIGNED_SHORT:
        memcpy(&u16, at, sizeof u16);
        return u16;
    default:
        memcpy(&u32, at, sizeof u32);
        return u32;
    }
}

static bool is_index_component(int component)
{
    return component == GLTF_UNSIGNED_BYTE || component == GLTF_UNSIGNED_SHORT ||
           component == GLTF_UNSIGNED_INT;
}

static bool open_sparse(const struct accessor_source *source, const struct gltf_accessor *a,
                        size_t element_bytes, struct accessor *out, struct error *err)
{
    if (a->sparse_count < 1 || (uint32_t)a->sparse_count > out->count)
        return error_set(err, ERROR_INVALID_SCENE, "accessor %d: %d sparse elements of %u",
                         out->index, a->sparse_count, out->count);
    if (!is_index_component(a->sparse_index_component))
        return error_set(err, ERROR_INVALID_SCENE,
                         "accessor %d: sparse indices of component type %d", out->index,
                         a->sparse_index_component);
    if (a->sparse_index_offset < 0 || a->sparse_value_offset < 0)
        return error_set(err, ERROR_INVALID_SCENE, "accessor %d: negative sparse byteOffset",
                         out->index);
    out->sparse_component = (enum gltf_component)a->sparse_index_component;
    size_t index_bytes = component_bytes(a->sparse_index_component);
    uint32_t count = (uint32_t)a->sparse_count;
    if (!open_range(source, out->index, a->sparse_index_view, (uint64_t)a->sparse_index_offset,
                    count, index_bytes, index_bytes, &out->sparse_indices, err) ||
        !open_range(source, out->index, a->sparse_value_view, (uint64_t)a->sparse_value_offset,
                    count, element_bytes, element_bytes, &out->sparse_values, err))
        return false;
    uint32_t previous = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t index =
            read_unsigned(out->sparse_indices + i * index_bytes, out->sparse_component);
        if (index >= out->count || (i > 0 && index <= previous))
            return error_set(err, ERROR_INVALID_SCENE,
                             "accessor %d: sparse index %u at %u is not increasing and below %u",
                             out->index, index, i, out->count);
        previous = index;
    }
    out->sparse_count = count;
    return true;
}

/* Fills all but where the elements lie. */
static bool describe(const struct accessor_source *source, int index, bool is_matrix,
                     struct accessor *out, struct error *err)
{
    memset(out, 0, sizeof *out);
    if (index < 0 || (size_t)index >= source->document->accessor_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no accessor %d", index);
    const struct gltf_accessor *a = &source->document->accessors[index];
    size_t bytes = component_bytes(a->component);
    if (is_matrix && (!a->is_matrix_4x4 || a->component != GLTF_FLOAT))
        return error_set(err, ERROR_INVALID_SCENE,
                         "accessor %d: its elements are no 4 x 4 matrices of floats", index);
    if (!bytes || (!is_matrix && a->components < 1))
        return error_set(err, ERROR_INVALID_SCENE,
                         "accessor %d: component type %d or element type cannot be drawn", index,
                         a->component);
    if (a->count < 1 || a->count > UINT32_MAX)
        return error_set(err, ERROR_INVALID_SCENE,
                         "accessor %d: count %llu is not in [1, 4294967295]", index,
                         (unsigned long long)a->count);
    out->index = index;
    out->count = (uint32_t)a->count;
    out->components = is_matrix ? 16 : a->components;
    out->component = (enum gltf_component)a->component;
    out->is_normalized =
        a->is_normalized && a->component != GLTF_FLOAT && a->component != GLTF_UNSIGNED_INT;
    out->stride = bytes * (size_t)out->components;
    return true;
}

bool accessor_open_decoded(const struct accessor_source *source, int index, const void *bytes,
                           struct accessor *out, struct error *err)
{
    if (!describe(source, index, false, out, err))
        return false;
    out->bytes = bytes;
    return true;
}

static bool open_elements(const struct accessor_source *source, int index, bool is_matrix,
                          struct accessor *out, struct error *err)
{
    if (!describe(source, index, is_matrix, out, err))
        return false;
    const struct gltf_accessor *a = &source->document->accessors[index];
    size_t element_bytes = out->stride;
    if (a->buffer_view >= 0) {
        uint64_t stride = 0;
        if ((size_t)a->buffer_view < source->document->view_count)
            stride = source->document->views[a->buffer_view].byte_stride;
        out->stride = stride ? (size_t)stride : element_bytes;
        if (!open_range(source, index, a->buffer_view, a->byte_offset, a->count, out->stride,
                        element_bytes, &out->bytes, err))
            return false;
    } else if (a->count > ZEROED_ELEMENTS_MAX) {
        return error_set(err, ERROR_TOO_LARGE,
                         "accessor %d: %u elements without a buffer view, limit is %d", index,
                         out->count, ZEROED_ELEMENTS_MAX);
    }
    return !a->is_sparse || open_sparse(source, a, element_bytes, out, err);
}

bool accessor_open(const struct accessor_source *source, int index, struct accessor *accessor,
                   struct error *err)
{
    return open_elements(source, index, false, accessor, err);
}

bool accessor_open_matrices(const struct accessor_source *source, int index,
                            struct accessor *accessor, struct error *err)
{
    return open_elements(source, index, true, accessor, err);
}

/* Where an element lies: among the sparse values, in the buffer, or nowhere (zero). */
static const uint8_t *element_bytes_at(const struct accessor *a, uint32_t element)
{
    size_t index_bytes = a->sparse_count ? component_bytes(a->sparse_component) : 0;
    uint32_t low = 0, high = a->sparse_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        uint32_t index =
            read_unsigned(a->sparse_indices + middle * index_bytes, a->sparse_component);
        if (index == element)
            return a->sparse_values +
                   (size_t)middle * component_bytes(a->component) * (size_t)a->components;
        if (index < element)
            low = middle + 1;
        else
            high = middle;
    }
    return a->bytes ? a->bytes + a->stride * element : NULL;
}

/* glTF 2.0 specification 3.6.2.2: max(c / 127, -1) and so on. */
static float read_component(const uint8_t *at, enum gltf_component component, bool is_normalized)
{
    int8_t i8;
    int16_t i16;
    float f;
    switch (component) {
    case GLTF_BYTE:
        memcpy(&i8, at, sizeof i8);
        return is_normalized ? fmaxf(i8 / 127.0f, -1) : i8;
    case GLTF_UNSIGNED_BYTE:
        return is_normalized ? *at / 255.0f : *at;
    case GLTF_SHORT:
        memcpy(&i16, at, sizeof i16);
        return is_normalized ? fmaxf(i16 / 32767.0f, -1) : i16;
    case GLTF_UNSIGNED_SHORT:
        return (float)read_unsigned(at, component) / (is_normalized ? 65535.0f : 1);
    case GLTF_UNSIGNED_INT:
        return (float)read_unsigned(at, component);
    default:
        memcpy(&f, at, sizeof f);
        return f;
    }
}

bool accessor_read(const struct accessor *a, uint32_t element, float *out, struct error *err)
{
    const uint8_t *at = element_bytes_at(a, element);
    size_t bytes = component_bytes(a->component);
    for (int i = 0; i < a->components; i++) {
        out[i] = at ? read_component(at + (size_t)i * bytes, a->component, a->is_normalized) : 0;
        if (!isfinite(out[i]))
            return error_set(err, ERROR_INVALID_SCENE, "accessor %d: element %u is not finite",
                             a->index, element);
    }
    return true;
}

uint32_t accessor_read_index(const struct accessor *a, uint32_t element)
{
    const uint8_t *at = element_bytes_at(a, element);
    return at ? read_unsigned(at, a->component) : 0;
}

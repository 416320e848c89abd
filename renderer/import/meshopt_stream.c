/* SPDX-License-Identifier: MIT */
/* The one home of meshoptimizer: checks before it is called, since it asserts what it does not
 * check. */
#include "renderer/import/meshopt_stream.h"

#include <meshoptimizer.h>
#include <string.h>

/* A vertex stream has at least 2 bits for 256 bytes, an index stream a byte for a triangle. */
#define EXPANSION_MAX 1024u

enum {
    WRONG_HEADER = -1, /* what the decoders answer to a mode or version they do not know */
};

typedef void filter_function(void *buffer, size_t count, size_t stride);

struct filter {
    const char *name;
    int strides[2];        /* that it takes; 0, 0: any */
    filter_function *call; /* NULL: the library does not have it */
};

static const struct filter filters[] = {
    {"OCTAHEDRAL", {4, 8}, meshopt_decodeFilterOct},
    {"QUATERNION", {8, 8}, meshopt_decodeFilterQuat},
    {"EXPONENTIAL", {0, 0}, meshopt_decodeFilterExp},
#if MESHOPTIMIZER_VERSION >= 250
    {"COLOR", {4, 8}, meshopt_decodeFilterColor},
#else
    {"COLOR", {4, 8}, NULL},
#endif
};

static bool is_mode(const struct gltf_meshopt *from, const char *mode)
{
    return strcmp(from->mode, mode) == 0;
}

/* NULL for none. */
static const struct filter *filter_of(const struct gltf_meshopt *from)
{
    for (size_t i = 0; i < sizeof filters / sizeof *filters; i++)
        if (strcmp(from->filter, filters[i].name) == 0)
            return &filters[i];
    return NULL;
}

static bool check_filter(const struct gltf_meshopt *from, struct error *err)
{
    const struct filter *filter = filter_of(from);
    if (strcmp(from->filter, "NONE") == 0)
        return true;
    if (!filter)
        return error_set(err, ERROR_INVALID_SCENE, "filter is '%.40s', which is unknown",
                         from->filter);
    if (!is_mode(from, "ATTRIBUTES"))
        return error_set(err, ERROR_INVALID_SCENE, "filter %s goes with the mode ATTRIBUTES only",
                         filter->name);
    if (filter->strides[0] && from->byte_stride != filter->strides[0] &&
        from->byte_stride != filter->strides[1])
        return error_set(err, ERROR_INVALID_SCENE, "byteStride %d is none of the filter %s",
                         from->byte_stride, filter->name);
    return filter->call ||
           error_set(err, ERROR_UNSUPPORTED, "filter %s is not supported by meshoptimizer %d.%d",
                     filter->name, MESHOPTIMIZER_VERSION / 1000, MESHOPTIMIZER_VERSION / 10 % 100);
}

static bool check_stride(const struct gltf_meshopt *from, struct error *err)
{
    int stride = from->byte_stride;
    if (is_mode(from, "ATTRIBUTES"))
        return (stride >= 4 && stride <= 256 && stride % 4 == 0) ||
               error_set(err, ERROR_INVALID_SCENE,
                         "byteStride is %d, not a multiple of 4 in [4, 256]", stride);
    if (!is_mode(from, "TRIANGLES") && !is_mode(from, "INDICES"))
        return error_set(err, ERROR_INVALID_SCENE,
                         "mode is '%.40s', not ATTRIBUTES, TRIANGLES or INDICES", from->mode);
    return stride == 2 || stride == 4 ||
           error_set(err, ERROR_INVALID_SCENE, "byteStride is %d, that of %s must be 2 or 4",
                     stride, from->mode);
}

bool meshopt_stream_init(struct meshopt_stream *stream, const struct gltf_meshopt *from,
                         struct error *err)
{
    stream->from = from;
    if (!check_stride(from, err) || !check_filter(from, err))
        return false;
    if (from->count < 1)
        return error_set(err, ERROR_INVALID_SCENE, "count is %d, not positive", from->count);
    if (is_mode(from, "TRIANGLES") && from->count % 3 != 0)
        return error_set(err, ERROR_INVALID_SCENE, "count is %d, that of TRIANGLES is 3 for each",
                         from->count);
    stream->decoded_bytes = (uint64_t)from->count * (uint64_t)from->byte_stride;
    if (stream->decoded_bytes / EXPANSION_MAX > stream->size_bytes)
        return error_set(err, ERROR_INVALID_SCENE, "%d elements of %d bytes cannot be in %zu bytes",
                         from->count, from->byte_stride, stream->size_bytes);
    return true;
}

bool meshopt_stream_decode(const struct meshopt_stream *stream, void *out, struct error *err)
{
    const struct gltf_meshopt *from = stream->from;
    const struct filter *filter = filter_of(from);
    size_t count = (size_t)from->count, stride = (size_t)from->byte_stride;
    int result;
    uint8_t header;
    if (is_mode(from, "ATTRIBUTES")) {
        header = 0xa0;
        result = meshopt_decodeVertexBuffer(out, count, stride, stream->bytes, stream->size_bytes);
    } else if (is_mode(from, "TRIANGLES")) {
        header = 0xe0;
        result = meshopt_decodeIndexBuffer(out, count, stride, stream->bytes, stream->size_bytes);
    } else {
        header = 0xd0;
        result = meshopt_decodeIndexSequence(out, count, stride, stream->bytes, stream->size_bytes);
    }
    if (result == WRONG_HEADER && (stream->bytes[0] & 0xf0) == header)
        return error_set(err, ERROR_UNSUPPORTED,
                         "version %d of %s is not supported by meshoptimizer %d.%d",
                         stream->bytes[0] & 0x0f, from->mode, MESHOPTIMIZER_VERSION / 1000,
                         MESHOPTIMIZER_VERSION / 10 % 100);
    if (result != 0)
        return error_set(err, ERROR_INVALID_SCENE,
                         "the %zu bytes are no stream of %s with %d elements of %d bytes",
                         stream->size_bytes, from->mode, from->count, from->byte_stride);
    if (filter)
        filter->call(out, count, stride);
    return true;
}

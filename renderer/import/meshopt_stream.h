/* SPDX-License-Identifier: MIT */
/* Streams of EXT_meshopt_compression and KHR_meshopt_compression: a buffer view's worth of vertices
 * or indices, decoded by meshoptimizer. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_MESHOPT_STREAM_H
#define VITRAIL_RENDERER_IMPORT_MESHOPT_STREAM_H

#include "renderer/import/gltf_shim.h"

struct meshopt_stream {
    const uint8_t *bytes; /* required, borrowed */
    size_t size_bytes;    /* required; not 0 */

    /* meshopt_stream_init fills these. */
    const struct gltf_meshopt *from;
    uint64_t decoded_bytes; /* at most 1024 for each byte of the stream */
};

/* Checks mode, filter, stride and count, and that so many elements can be in a stream of this size.
 * ERROR_INVALID_SCENE; ERROR_UNSUPPORTED for a filter that the library does not have. */
MUST_CHECK bool meshopt_stream_init(struct meshopt_stream *stream, const struct gltf_meshopt *from,
                                    struct error *err);

/* Writes decoded_bytes. ERROR_INVALID_SCENE for a stream that is cut, longer than its content or
 * broken; ERROR_UNSUPPORTED for a version that the library does not have. What comes out is any
 * number whatever: indices are not checked. */
MUST_CHECK bool meshopt_stream_decode(const struct meshopt_stream *stream, void *out,
                                      struct error *err);

#endif

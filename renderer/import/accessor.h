/* SPDX-License-Identifier: MIT */
/* Checked reading of glTF accessors: strided, normalised, sparse. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_ACCESSOR_H
#define VITRAIL_RENDERER_IMPORT_ACCESSOR_H

#include "renderer/import/gltf_package.h"
#include "renderer/import/gltf_shim.h"

/* What accessors read from: the document and the bytes of its buffers, both borrowed. */
struct accessor_source {
    const struct gltf_document *document;
    const struct gltf_bytes *buffers; /* no bytes: the buffer has none of its own */
    size_t buffer_count;
    struct gltf_bytes *decoded; /* by view: its bytes once decoded, where it is compressed */
    uint64_t *decodable_bytes;  /* how many more may be decoded */
};

/* An accessor whose every element is known to lie inside its buffers. Borrows from its source. */
struct accessor {
    int index; /* of the document, for messages */
    uint32_t count;
    int components;
    enum gltf_component component;
    bool is_normalized;
    const uint8_t *bytes; /* NULL: all zero but for the sparse elements */
    size_t stride;
    uint32_t sparse_count; /* strictly increasing indices below count */
    enum gltf_component sparse_component;
    const uint8_t *sparse_indices, *sparse_values;
};

/* Bytes of a buffer view, checked to lie in its buffer; those of a compressed view are decoded the
 * first time, and live as long as source->decoded. `who` names the user of the view in
 * messages. */
MUST_CHECK bool accessor_view_bytes(const struct accessor_source *source, int view, const char *who,
                                    const uint8_t **bytes, uint64_t *size_bytes, struct error *err);

/* ERROR_INVALID_SCENE naming the accessor and what is wrong with it. */
MUST_CHECK bool accessor_open(const struct accessor_source *source, int index,
                              struct accessor *accessor, struct error *err);

/* The same for an accessor whose elements came out of a compressed stream: `bytes` holds all of
 * them, tightly packed, and lives as long as the accessor. */
MUST_CHECK bool accessor_open_decoded(const struct accessor_source *source, int index,
                                      const void *bytes, struct accessor *accessor,
                                      struct error *err);
/* The same for 4 x 4 matrices of floats, which accessor_open refuses: 16 components each. */
MUST_CHECK bool accessor_open_matrices(const struct accessor_source *source, int index,
                                       struct accessor *accessor, struct error *err);

/* One element as floats, normalised integers to [0,1] or [-1,1]. Refuses NaN and infinity by
 * element. out: as many as it has components, at most 4 but of matrices. */
MUST_CHECK bool accessor_read(const struct accessor *accessor, uint32_t element, float *out,
                              struct error *err);

/* One element of a scalar accessor of unsigned integers. */
uint32_t accessor_read_index(const struct accessor *accessor, uint32_t element);

#endif

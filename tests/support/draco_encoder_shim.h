/* SPDX-License-Identifier: MIT */
/* Streams of KHR_draco_mesh_compression for tests. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_DRACO_ENCODER_SHIM_H
#define VITRAIL_TESTS_SUPPORT_DRACO_ENCODER_SHIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct draco_encoder_desc {
    uint32_t points, triangles;
    const uint32_t *indices; /* required; 3 of each triangle */
    const float *positions;  /* required; attribute 0 */
    const float *normals;    /* attribute 1; may be NULL */
    int position_bits;       /* 0: not quantised */
    bool is_sequential;      /* else edgebreaker, which sorts points and triangles anew */
};

/* The stream, which the caller frees; NULL on failure. */
void *draco_encode(const struct draco_encoder_desc *desc, size_t *size_bytes);

/* The decoder with nothing around it: points of the mesh, 0 on failure. */
uint32_t draco_decode(const void *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif
#endif

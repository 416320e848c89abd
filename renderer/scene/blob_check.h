/* SPDX-License-Identifier: MIT */
/* What the checks of a scene blob have in common. Private to renderer/scene. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_BLOB_CHECK_H
#define VITRAIL_RENDERER_SCENE_BLOB_CHECK_H

#include "protocol/error.h"

/* ERROR_INVALID_SCENE, naming the record. Returns false. */
static inline bool blob_refuse(struct error *err, const char *what, uint64_t index)
{
    return error_set(err, ERROR_INVALID_SCENE, "scene blob: %s %llu is malformed", what,
                     (unsigned long long)index);
}

static inline bool blob_are_finite(const float *values, uint64_t count)
{
    float sum = 0; /* stays zero unless some value is NaN or infinite */
    for (uint64_t i = 0; i < count; i++)
        sum += values[i] * 0;
    return sum == 0;
}

#endif

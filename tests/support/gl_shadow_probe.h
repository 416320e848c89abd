/* SPDX-License-Identifier: MIT */
/* Answers shadow queries at given points through the very shader code that shading uses. Thread:
 * GL. */
#ifndef VITRAIL_TESTS_SUPPORT_GL_SHADOW_PROBE_H
#define VITRAIL_TESTS_SUPPORT_GL_SHADOW_PROBE_H

#include "renderer/shadows/shadow_map.h"
#include "renderer/shadows/shadows.h"

struct shadow_probe_point { /* as shadow_probe.comp.glsl reads it */
    float p[3];             /* relative to the eye of the prepared frame [m] */
    uint32_t object;        /* node whose own events are left out; UINT32_MAX for none */
    float n[3];             /* geometric normal */
    uint32_t shadow;        /* shadow_system_record */
};

struct shadow_probe_desc {
    const struct shadow_probe_point *points; /* required */
    uint32_t count;
    int repeat;         /* asks so often, for measurements; 0 means once */
    bool asks_nothing;  /* reads the points and answers with something, to measure that alone */
    float tolerance[2]; /* tolerance as of shadow_query.glsl, for opaque casters and for lists */
};

/* Writes four floats per point: rgb transmittance and 1. */
MUST_CHECK bool shadow_probe_run(const struct shadow_system *shadows,
                                 struct program_cache *programs,
                                 const struct shadow_probe_desc *desc, float (*out)[4],
                                 struct error *err);

/* What stands for a light of the prepared frame (NULL for nothing), and the memory it lies in. */
const struct shadow_map *shadow_system_map(const struct shadow_system *shadows, size_t light);
const struct shadow_store *shadow_system_store(const struct shadow_system *shadows);

#endif

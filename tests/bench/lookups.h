/* SPDX-License-Identifier: MIT */
/* The shadow lookups of a frame alone: the points that it shades, opaque and in every layer, ask
 * for the same lights with the same taps (tests/support/shaders/shadow_lookups.comp.glsl). Thread:
 * GL. */
#ifndef VITRAIL_TESTS_BENCH_LOOKUPS_H
#define VITRAIL_TESTS_BENCH_LOOKUPS_H

#include "renderer/shading/shade.h"

struct lookup_times {
    double asked_cpu_ms, asked_wall_ms;   /* finding the lights and looking them up */
    double silent_cpu_ms, silent_wall_ms; /* the same without the lookups */
    uint64_t lookups;                     /* how many there were */
};

/* After shade_window, with what it was given: one window, all of whose lights are shaded at once
 * and whose shadows are in structures. */
MUST_CHECK bool lookups_measure(struct shade *shade, const struct shade_desc *desc,
                                struct lookup_times *times, struct error *err);

#endif

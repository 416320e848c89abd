/* SPDX-License-Identifier: MIT */
/* The other yardstick of suite `traced`: the rays of the bare tracer (bare_tracer.h), and at each
 * layer all that the picture requires of a material without textures: normals of vertices, GGX and
 * Lambert under Schlick's Fresnel, coverage, cones and falloff. Sixteen lanes of f32 side by side,
 * vectorised for each kind of processor; no light lists, no order of hits, no bits to keep. So it
 * tells what the picture costs on Embree at least, where bare_tracer tells what its rays cost.
 * Thread: one. */
#ifndef VITRAIL_TESTS_BENCH_FULL_TRACER_H
#define VITRAIL_TESTS_BENCH_FULL_TRACER_H

#include "tests/bench/bare_tracer.h"

struct full_tracer;

/* NULL on failure. bare: borrowed; has the triangles of the same state. */
struct full_tracer *full_tracer_create(const struct bare_tracer *bare,
                                       const struct scene_state *state, struct error *err);
void full_tracer_destroy(struct full_tracer *tracer); /* accepts NULL */

/* A picture of linear radiance, one ray in the middle of each pixel. */
MUST_CHECK bool full_tracer_render(const struct full_tracer *tracer, const struct camera *camera,
                                   const struct scene_state *state, struct image *image,
                                   struct error *err);

#endif

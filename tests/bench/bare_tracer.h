/* SPDX-License-Identifier: MIT */
/* The yardstick of suite `traced`: the least that a renderer on Embree does for coloured shadows.
 * Packets of 8 rays in f32, one ray in the middle of each pixel, every light asked at every layer,
 * Lambert's cosine alone, one colour and one filter per mesh, no textures, no media. With several
 * samples the others only find what they meet: light is asked for at the first one alone. Thread:
 * one.
 */
#ifndef VITRAIL_TESTS_BENCH_BARE_TRACER_H
#define VITRAIL_TESTS_BENCH_BARE_TRACER_H

#include "renderer/image/image.h"
#include "renderer/scene/camera.h"
#include "renderer/scene/scene_state.h"

struct bare_tracer;

/* NULL on failure. state: borrowed for the call alone. */
struct bare_tracer *bare_tracer_create(const struct scene_state *state, struct error *err);
void bare_tracer_destroy(struct bare_tracer *tracer);

/* Of the state's items in order, a triangle each for its own; borrowed. has_sixteen: out, whether
 * the processor takes packets of 16 rays. */
struct RTCSceneTy *bare_tracer_scene(const struct bare_tracer *tracer, bool *has_sixteen);

/* What Embree has allocated for it, triangles included. */
uint64_t bare_tracer_size_bytes(const struct bare_tracer *tracer);

/* A picture of linear radiance. samples: 1, 4 or 8. rays: out, camera rays and shadow rays
 * together. */
MUST_CHECK bool bare_tracer_render(const struct bare_tracer *tracer, const struct camera *camera,
                                   const struct scene_state *state, int samples,
                                   struct image *image, uint64_t *rays, struct error *err);

#endif

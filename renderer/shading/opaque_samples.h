/* SPDX-License-Identifier: MIT */
/* The sets of opaque surfaces: the samples of all pixels of a window, and of the pixels in which
 * samples are lit apart (renderer/window/apart.h). Their program also composites the transparent
 * surfaces over them. Thread: GL, but for the kinds. */
#ifndef VITRAIL_RENDERER_SHADING_OPAQUE_SAMPLES_H
#define VITRAIL_RENDERER_SHADING_OPAQUE_SAMPLES_H

#include "renderer/window/surface_set.h"

extern const struct surface_kind opaque_samples, samples_apart;

struct surface_set opaque_samples_of(const struct window_frame *frame);
/* The samples of `count` pixels of the list from the first-th on, a multiple of 64. 0: of all of
 * them; is_counted: the list's length is read for that, which waits for the device. */
struct surface_set samples_apart_of(const struct window_frame *frame, uint32_t first,
                                    uint32_t count, bool is_counted);

/* The uniforms of the background, and of a backdrop (shaders/shading/backdrop.glsl). */
void opaque_samples_set_background(const struct view *view, const struct gl_program *program);

#endif

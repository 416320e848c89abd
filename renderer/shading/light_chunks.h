/* SPDX-License-Identifier: MIT */
/* Which part of a window's lights one dispatch walks. Long light lists are walked in chunks, each
 * going on with the sums of the one before it, because loops end (renderer/shading/loop_steps.h);
 * lights whose shadows exceed the memory come in batches (renderer/frame/light_batches.h).
 * Thread: any, but for light_chunks_choose, which is GL's. */
#ifndef VITRAIL_RENDERER_SHADING_LIGHT_CHUNKS_H
#define VITRAIL_RENDERER_SHADING_LIGHT_CHUNKS_H

#include "renderer/shading/loop_steps.h"
#include "renderer/window/window.h"

struct shade_desc; /* renderer/shading/shade.h */

/* A part of the light lists, walked by one dispatch. */
struct light_chunk {
    uint32_t first, count;
    bool is_whole;          /* of the lists; first and count mean nothing */
    bool is_first, is_last; /* of all dispatches over the window */
};

/* The first chunk of those that all surfaces of the window are lit with, and how many they are.
 * ERROR_OVER_BUDGET: no chunk is short enough. */
MUST_CHECK bool light_chunks_choose(const struct shade_desc *desc, uint64_t loop_steps,
                                    struct light_chunk *chunk, uint32_t *chunk_count,
                                    struct error *err);

/* Texels of a shadow structure that one look takes; 1 of traced shadows. */
uint32_t light_taps(const struct window_frame *frame, bool is_traced);

/* Lights of a window at once, in batches, or in chunks of their lists. */
enum light_parts { LIGHTS_AT_ONCE, LIGHTS_IN_BATCHES, LIGHTS_IN_CHUNKS, LIGHT_PARTS };

struct light_parts_desc {
    const struct window_frame *frame; /* required; what shade_list_programs needs */
    uint64_t loop_steps;              /* required; of struct shade */
    size_t shadowed_count;            /* lights whose shadow is looked up, at most */
    bool is_traced, is_in_batches, has_layers;
};
/* Which of them windows of a frame may take: chunks where the lights that are everywhere are too
 * many for one dispatch, or all lights at one point behind lists of 4096 events and below as many
 * layers, which only drawing finds. Returns how many. */
int light_parts_list(const struct light_parts_desc *desc, bool may[LIGHT_PARTS]);

/* Whether the samples of a pixel walk its list one after the other (SAMPLES_IN_TURN of
 * shaders/shading/shade_pixels.comp.glsl): where registers are scarce, as they are on all but
 * processors, whose loops cost most. */
bool samples_take_turns(const struct gl_limits *limits);

#endif

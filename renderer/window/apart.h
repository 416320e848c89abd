/* SPDX-License-Identifier: MIT */
/* Which pixels of a window have their samples shaded apart: those in which light differs from that
 * of their neighbours (shaders/window/light_apart.comp.glsl). Thread: GL. */
#ifndef VITRAIL_RENDERER_WINDOW_APART_H
#define VITRAIL_RENDERER_WINDOW_APART_H

#include "renderer/gl/program_list.h"
#include "renderer/window/window.h"

/* Where in targets.apart the list of these pixels has three words of groups for an indirect
 * dispatch, and the number of pixels. */
uint64_t apart_groups_bytes_at(const struct targets *targets);
uint64_t apart_count_bytes_at(const struct targets *targets);

/* Whether samples are ever shaded apart: where there are several, and lights. */
bool apart_is_possible(const struct window_frame *frame);
/* Lists the pixels of the window, which is shaded, in frame->targets, which has room. */
MUST_CHECK bool apart_find(const struct window_frame *frame, struct error *err);
/* Binds the list, for shaders/window/apart.glsl. */
void apart_bind(const struct targets *targets);
/* How many they are; waits for the device. */
uint32_t apart_count(const struct window_frame *frame);
/* The programs that list them, where they may be. Thread: any. */
void apart_list_programs(const struct window_frame *frame, struct program_list *list);

#endif

/* SPDX-License-Identifier: MIT */
/* The mean of several rounds of samples (renderer/base/sample_pattern.h), in linear light and
 * before tone mapping, as the samples of one round are averaged. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADING_ACCUMULATION_H
#define VITRAIL_RENDERER_SHADING_ACCUMULATION_H

#include "renderer/gl/program_list.h"
#include "renderer/window/window.h"

/* Whether shading leaves the picture to be mapped over its backdrop here, since rounds or the light
 * of lamps in haze come behind it: u_behind of shaders/shading/shade_pixels.comp.glsl. */
bool accumulation_maps(const struct window_frame *frame);
/* Whether there is anything to do here: otherwise the picture is complete when it is shaded. */
bool accumulation_is_there(const struct window_frame *frame);
/* The #define items of this for a program with HAS_BACKDROP, which come before it in `defines`; ""
 * without. */
const char *accumulation_defines(const struct window_frame *frame);
/* Binds the image that such programs write; nothing without. */
void accumulation_bind(const struct window_frame *frame);

/* Adds the window's image, that of frame->round; after the last round the image is the mean. */
MUST_CHECK bool accumulation_add(const struct window_frame *frame, const char *because,
                                 struct error *err);
void accumulation_list_programs(const struct window_frame *frame, struct program_list *list);

#endif

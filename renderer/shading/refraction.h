/* SPDX-License-Identifier: MIT */
/* What is seen through surfaces that refract or scatter, in the picture of a window
 * (docs/explanation/shading.md, section 8): shading has left the picture without them in
 * targets->levels, and of each pixel with one what is before and what it lets through. Thread: GL,
 * but for the list. */
#ifndef VITRAIL_RENDERER_SHADING_REFRACTION_H
#define VITRAIL_RENDERER_SHADING_REFRACTION_H

#include "renderer/transparency/method.h"
#include "renderer/window/window.h"

/* Whether layers that some window has may bend light. */
bool refraction_is_possible(const struct window_frame *frame);

/* Makes what shading writes for it where it is absent, and binds it. */
MUST_CHECK bool refraction_prepare(const struct window_frame *frame, struct error *err);
void refraction_bind(const struct window_frame *frame);

/* Blurs, and completes frame->targets->image. layers: found for the window, with surfaces. because:
 * for the report. */
MUST_CHECK bool refraction_draw(const struct window_frame *frame, const struct layers *layers,
                                const char *because, struct error *err);

void refraction_list_programs(const struct window_frame *frame, struct program_list *list);

#endif

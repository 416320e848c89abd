/* SPDX-License-Identifier: MIT */
/* The steps of a plan that trace shadows for a rasterised frame. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_SHADOWS_H
#define VITRAIL_RENDERER_FRAME_FRAME_SHADOWS_H

#include "renderer/frame/frame_run.h"

/* Makes renderer->shadow_rays ready for the frame's windows. */
MUST_CHECK bool frame_shadows_begin(const struct frame_run *run, struct error *err);

/* After the window's surfaces, layers and light lists. Sets *overflows where its points or their
 * rays have no room. */
MUST_CHECK bool frame_shadows_collect(const struct frame_run *run, const struct window_frame *frame,
                                      bool *overflows, struct error *err);

/* Reports, and drops what belongs to the frame, whether that came about or not. */
void frame_shadows_end(const struct frame_run *run);

#endif

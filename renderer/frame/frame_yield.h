/* SPDX-License-Identifier: MIT */
/* The yield points of a frame. Urgent frames are made in a frame context of their own; what the two
 * contexts share (scenes, programs, shadow structures, the state of GL) is put back when the frame
 * goes on. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_YIELD_H
#define VITRAIL_RENDERER_FRAME_FRAME_YIELD_H

#include "renderer/base/yield_point.h"
#include "renderer/frame/frame_run.h"

/* Afterwards all is as it was, but for bindings and uniforms. The run is borrowed. */
struct yield_point frame_yield_point(const struct frame_run *run);
/* The same without shadow structures and the lights on the device: while these are made. */
struct yield_point frame_yield_point_of_shadows(const struct frame_run *run);
/* The pointer, or NULL if the frame never yields. */
const struct yield_point *frame_yield_if_any(const struct frame_run *run,
                                             const struct yield_point *point);

/* The callback raytrace_desc.advance of a frame context: reports progress of the span that rays
 * cover. Thread: any. */
void frame_advance_rays(void *frame_context, double share);

#endif

/* SPDX-License-Identifier: MIT */
/* A frame that stops for others. They are made by a renderer beside the first, which shares its
 * context, programs, scenes and shadow structures and has all else that frames hold of its own;
 * so a paused frame finds all as it was, but for the shadow structures. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_PAUSE_H
#define VITRAIL_RENDERER_FRAME_FRAME_PAUSE_H

#include "renderer/base/interlude.h"
#include "renderer/frame/renderer_internal.h"

struct frame_pause {
    struct renderer *renderer;   /* required */
    struct frame_report *report; /* required: gets the passes so far, and how long others took */
};

/* An interlude in which the renderer is ready for other frames. pause is borrowed, as its members
 * are. */
struct interlude frame_pause_interlude(struct frame_pause *pause);

/* raytrace_desc's progress for frames of the renderer that is its context: tells of the piece that
 * they are, and ends rays that are not wanted any more. Thread: any. */
bool frame_pause_ends_rays(void *renderer, double share);

/* Who makes frames while the renderer's own is paused; made at the first call. NULL with err. */
struct renderer *frame_pause_other(struct renderer *renderer, struct error *err);

#endif

/* SPDX-License-Identifier: MIT */
/* A window's linear image as a screen shows it, made on the device, so that three or four bytes of
 * a pixel come back in the place of sixteen. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADING_SCREEN_H
#define VITRAIL_RENDERER_SHADING_SCREEN_H

#include "renderer/gl/program_list.h"
#include "renderer/window/window.h"

struct screen {               /* zeroed: nothing is made */
    struct gl_buffer words;   /* rows, the top one first, without gaps: 3 or 4 bytes a pixel */
    struct gl_buffer buckets; /* struct tone_bucket[] */
};

/* What a window takes in `words`. */
uint64_t screen_bytes(const struct camera_window *window, int channels);
/* Of frame->targets->image, under frame->view->screen, within a scope. What reads `words` needs a
 * barrier. */
MUST_CHECK bool screen_draw(struct screen *screen, const struct window_frame *frame, int channels,
                            struct error *err);
void screen_list_programs(struct program_list *list);
void screen_finish(struct screen *screen);
uint64_t screen_size_bytes(const struct screen *screen);

#endif

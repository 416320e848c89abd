/* SPDX-License-Identifier: MIT */
/* The end of a frame: at once, or later, when its picture has come from the device and the
 * processor has begun the next one. One frame is in flight at a time, and none of those that a
 * paused frame stops for. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_FLIGHT_H
#define VITRAIL_RENDERER_FRAME_FRAME_FLIGHT_H

#include "renderer/frame/renderer_internal.h"

/* Where passes of later frames begin or wait, the one in flight may be collected. */
void frame_flight_init(struct renderer *renderer);
void frame_flight_finish(struct renderer *renderer); /* what is in flight is dropped */

struct frame_ending {
    struct frame *frame;     /* required */
    const struct plan *plan; /* required; of the frame, used in the call */
    double begin_ms;         /* required: wall_ms */
    const char *scene_key;   /* required, with the view: what it would be made again from, ... */
    const struct view *view; /* ... valid until it is collected */
    struct content_key pace_key; /* required: of frames that take as long */
    struct content_key picture;  /* required: of frame_run */
    struct frame_lesson lesson;
    bool has_failed; /* it is emptied */
};
/* After the last command of a frame: it takes off, and *is_done becomes false, or it ends here:
 * with NULL for is_done, where nothing of it is under way, and where it cannot fly. */
MUST_CHECK bool frame_flight_end(struct renderer *renderer, const struct frame_ending *ending,
                                 bool *is_done, struct error *err);
/* The frame in flight has come while another one ran, with lists that were cut: who waits for its
 * arrival collects it now, and has it made again. Where no frame runs, or one is paused. */
bool frame_flight_is_cut(const struct renderer *renderer);
void frame_flight_deliver(struct renderer *renderer);

#endif

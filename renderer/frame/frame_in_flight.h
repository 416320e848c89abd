/* SPDX-License-Identifier: MIT */
/* Frames in flight. A frame ends at once, or later: then the device still draws it while the
 * processor records the next one. At most one frame is in flight, and never one that preempts
 * another. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_IN_FLIGHT_H
#define VITRAIL_RENDERER_FRAME_FRAME_IN_FLIGHT_H

#include "renderer/frame/renderer_internal.h"

/* From now on the frame in flight is collected before a later frame waits for the device. */
void frame_in_flight_init(struct renderer *renderer);
/* Collects the frame in flight if it is complete; between the steps of a later frame. */
void frame_in_flight_poll(struct renderer *renderer);
void frame_in_flight_finish(struct renderer *renderer); /* drops the frame in flight */

struct frame_ending {
    struct frame *frame;         /* required */
    const struct plan *plan;     /* required; of the frame, used in the call */
    double begin_ms;             /* required: wall_ms */
    const char *scene_key;       /* required, with the view: to draw it again from, ... */
    const struct view *view;     /* ... valid until it is collected */
    struct content_key pace_key; /* required: of frames that take as long */
    struct content_key picture;  /* required: of frame_run */
    struct frame_observation observation;
    bool has_failed; /* the frame is emptied */
};
/* To be called after the last command of a frame. Either the frame is in flight from now on, and
 * *is_done becomes false, or it ends here: if is_done is NULL, if the device has completed it
 * already, or if it may not be in flight. */
MUST_CHECK bool frame_in_flight_end(struct frame_context *context,
                                    const struct frame_ending *ending, bool *is_done,
                                    struct error *err);
/* Whether the frame in flight was completed with lists that were cut while another frame ran. It
 * has to be drawn again, which frame_in_flight_deliver does: while no frame runs, or one has
 * yielded. */
bool frame_in_flight_is_cut(const struct renderer *renderer);
void frame_in_flight_deliver(struct renderer *renderer);

#endif

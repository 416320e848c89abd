/* SPDX-License-Identifier: MIT */
/* While nobody asks, the last picture of a view is drawn by the technique that came second, for
 * nobody to see: so `auto` learns what that takes. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_IDLE_TIMING_H
#define VITRAIL_SERVER_WORKER_IDLE_TIMING_H

#include <stdbool.h>
#include <stdint.h>

#include "renderer/renderer.h"
#include "server/base/ipc.h"

enum { IDLE_TIMING_AFTER_MS = 1000 /* without a message: warm-ups go before */ };

struct idle_timing {         /* zeroed: no picture is noted, nothing was timed */
    struct ipc_message last; /* the picture's message, with the text of its request alone */
    uint64_t timed, stopped; /* timings that came to their end, and that made way */
};

/* Notes the picture where the message is the render of a view, and takes the text from it. */
void idle_timing_note(struct idle_timing *timing, struct ipc_message *message);

/* The message of the picture that is to be timed; NULL: there is none. */
const json_t *idle_timing_message(const struct idle_timing *timing);

struct idle_timing_desc {
    struct renderer *renderer;         /* required; its scenes are those of the message, or ... */
    bool has_scenes;                   /* ... they are not there, and nothing is timed */
    bool (*shall_stop)(void *context); /* required: whether somebody asks; any thread */
    void *context;
};
/* Times the picture that is noted, once. True where the totals have changed. */
bool idle_timing_run(struct idle_timing *timing, const struct idle_timing_desc *desc);

void idle_timing_finish(struct idle_timing *timing);

#endif

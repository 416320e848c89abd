/* SPDX-License-Identifier: MIT */
/* How long pieces of a pass take (renderer/window/bands.h), and how far the device may be behind
 * with them. On our own processors each piece is waited for, which costs nothing. Any other device
 * has one piece before it beside the one that it is at, so that it never waits for the next one;
 * the processor waits for the piece before. Thread: GL. */
#ifndef VITRAIL_RENDERER_WINDOW_BAND_CLOCK_H
#define VITRAIL_RENDERER_WINDOW_BAND_CLOCK_H

#include "renderer/gl/object.h"
#include "renderer/gl/scope.h"
#include "renderer/window/bands.h"

struct band_clock {
    struct gpu_timeline *timeline; /* required */
    bool is_software;              /* required, of gl_limits */
    struct gl_fence fence;         /* behind the piece before, ... */
    uint64_t count;                /* ... and its units */
    double given_ms, before_ms;    /* when the last piece was given, and the one before, ... */
    double passed_ms;              /* ... and when one was done */
};

/* Before the commands of a piece. */
void band_clock_begin(struct band_clock *clock);
/* Behind them, where others follow: tells the bands how long a piece took. */
void band_clock_end(struct band_clock *clock, struct bands *bands);
void band_clock_finish(struct band_clock *clock); /* zeroed: nothing is on its way */

#endif

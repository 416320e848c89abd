/* SPDX-License-Identifier: MIT */
/* Measures how long the time slices of a pass take (renderer/window/time_slices.h), and limits how
 * far the device may be behind. In software the processor waits for each slice, which costs
 * nothing. A GPU always has one slice queued behind the one that it runs, so that it never waits
 * for work; the processor waits for the slice before. Thread: GL. */
#ifndef VITRAIL_RENDERER_WINDOW_TIME_SLICE_CLOCK_H
#define VITRAIL_RENDERER_WINDOW_TIME_SLICE_CLOCK_H

#include "renderer/gl/object.h"
#include "renderer/gl/scope.h"
#include "renderer/window/time_slices.h"

struct time_slice_clock {
    struct gpu_timeline *timeline; /* required */
    bool is_software;              /* required, of gl_limits */
    struct gl_fence fence;         /* after the slice before, ... */
    uint64_t count;                /* ... and its units */
    double given_ms, before_ms;    /* when the last slice was submitted, and the one before, ... */
    double passed_ms;              /* ... and when one was complete */
};

/* To be called before the commands of a slice. */
void time_slice_clock_begin(struct time_slice_clock *clock);
/* To be called after them, if other slices follow: tells `slices` how long a slice took. */
void time_slice_clock_end(struct time_slice_clock *clock, struct time_slices *slices);
void time_slice_clock_finish(struct time_slice_clock *clock); /* accepts zeroed */

#endif

/* SPDX-License-Identifier: MIT */
/* Sets a fence after each time slice. */
#include "renderer/window/time_slice_clock.h"

#include <epoxy/gl.h>
#include <math.h>

#include "renderer/base/wall_clock.h"

enum { WAIT_NS = 1000000000 };

void time_slice_clock_begin(struct time_slice_clock *clock)
{
    clock->given_ms = wall_ms();
}

/* Waits for the slice before, whose time begins when it was submitted or when the one before it was
 * complete. */
static void take_before(struct time_slice_clock *clock, struct time_slices *slices)
{
    if (!gl_fence_wait(&clock->fence, 0)) {
        gpu_timeline_will_wait(clock->timeline);
        while (!gl_fence_wait(&clock->fence, WAIT_NS))
            continue; /* the caller has a deadline for the process */
    }
    double now_ms = wall_ms();
    time_slices_learn(slices, clock->count, now_ms - fmax(clock->before_ms, clock->passed_ms));
    clock->passed_ms = now_ms;
    gl_fence_finish(&clock->fence);
}

void time_slice_clock_end(struct time_slice_clock *clock, struct time_slices *slices)
{
    if (clock->is_software) {
        gpu_timeline_will_wait(clock->timeline);
        glFinish();
        time_slices_learn(slices, slices->count, wall_ms() - clock->given_ms);
        return;
    }
    struct gl_fence fence = {0};
    gl_fence_set(&fence);
    if (clock->fence.sync)
        take_before(clock, slices);
    clock->fence = fence;
    clock->count = slices->count;
    clock->before_ms = clock->given_ms;
}

void time_slice_clock_finish(struct time_slice_clock *clock)
{
    gl_fence_finish(&clock->fence);
}

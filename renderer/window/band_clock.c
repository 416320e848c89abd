/* SPDX-License-Identifier: MIT */
/* A fence behind each piece. */
#include "renderer/window/band_clock.h"

#include <epoxy/gl.h>
#include <math.h>

#include "renderer/base/wall_clock.h"

enum { WAIT_NS = 1000000000 };

void band_clock_begin(struct band_clock *clock)
{
    clock->given_ms = wall_ms();
}

/* The piece before, whose time begins where it was given or the one before it was done. */
static void take_before(struct band_clock *clock, struct bands *bands)
{
    if (!gl_fence_wait(&clock->fence, 0)) {
        gpu_timeline_will_wait(clock->timeline);
        while (!gl_fence_wait(&clock->fence, WAIT_NS))
            continue; /* who asked has a deadline for the process */
    }
    double now_ms = wall_ms();
    bands_learn(bands, clock->count, now_ms - fmax(clock->before_ms, clock->passed_ms));
    clock->passed_ms = now_ms;
    gl_fence_finish(&clock->fence);
}

void band_clock_end(struct band_clock *clock, struct bands *bands)
{
    if (clock->is_software) {
        gpu_timeline_will_wait(clock->timeline);
        glFinish();
        bands_learn(bands, bands->count, wall_ms() - clock->given_ms);
        return;
    }
    struct gl_fence fence = {0};
    gl_fence_set(&fence);
    if (clock->fence.sync)
        take_before(clock, bands);
    clock->fence = fence;
    clock->count = bands->count;
    clock->before_ms = clock->given_ms;
}

void band_clock_finish(struct band_clock *clock)
{
    gl_fence_finish(&clock->fence);
}

/* SPDX-License-Identifier: MIT */
/* Clocks for timings. Thread: any. */
#ifndef VITRAIL_RENDERER_BASE_WALL_CLOCK_H
#define VITRAIL_RENDERER_BASE_WALL_CLOCK_H

#include <time.h>

static inline double clock_now_ms(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static inline double wall_ms(void)
{
    return clock_now_ms(CLOCK_MONOTONIC);
}

#endif

/* SPDX-License-Identifier: MIT */
/* Monotonic wall clock for timings. Thread: any. */
#ifndef VITRAIL_RENDERER_WALL_CLOCK_H
#define VITRAIL_RENDERER_WALL_CLOCK_H

#include <time.h>

static inline double wall_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

#endif

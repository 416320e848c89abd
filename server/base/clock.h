/* SPDX-License-Identifier: MIT */
/* Times that never go back, since a moment of the system's choice. Thread: any. */
#ifndef VITRAIL_SERVER_BASE_CLOCK_H
#define VITRAIL_SERVER_BASE_CLOCK_H

#include <stdint.h>
#include <time.h>

static inline int64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static inline int64_t now_ms(void)
{
    return now_us() / 1000;
}

/* The same to the microsecond, for durations that are reported. */
static inline double now_fine_ms(void)
{
    return 1e-3 * (double)now_us();
}

#endif

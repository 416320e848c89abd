/* SPDX-License-Identifier: MIT */
/* Time slices of a long pass. Urgent frames may run between two of them, so a slice takes about as
 * long as they may wait. How long a slice takes is only known from the one before it. Pure
 * functions. Thread: any. */
#ifndef VITRAIL_RENDERER_WINDOW_TIME_SLICES_H
#define VITRAIL_RENDERER_WINDOW_TIME_SLICES_H

#include <stdbool.h>
#include <stdint.h>

enum {
    TIME_SLICE_MS = 25, /* what a slice should take */
    /* A slice has at most so many times the units of the one before: parts of an image differ. */
    TIME_SLICE_GROWTH = 4,
    /* Pixels, or layers, of a first slice: 2 to 200 ms on two cores in software. */
    TIME_SLICE_FIRST = 1 << 15,
};

struct time_slices {
    uint64_t first, count; /* the units of the current slice */
    uint64_t end, granule, next_count;
};

/* Divides `total` units; first_count of 0: into one slice. Slices begin at multiples of the
 * granule. */
struct time_slices time_slices_begin(uint64_t total, uint64_t first_count, uint64_t granule);
/* Goes on to the next slice; false when there is none. */
bool time_slices_next(struct time_slices *slices);
bool time_slices_is_last(const struct time_slices *slices);
/* Notes how long a slice of so many units took, without urgent frames. */
void time_slices_learn(struct time_slices *slices, uint64_t count, double ms);

#endif

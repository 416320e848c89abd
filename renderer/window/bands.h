/* SPDX-License-Identifier: MIT */
/* A long pass in pieces, between which others may go first: each about as long as they may wait.
 * How long a piece takes is only known from the one before it. Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_WINDOW_BANDS_H
#define VITRAIL_RENDERER_WINDOW_BANDS_H

#include <stdbool.h>
#include <stdint.h>

enum {
    BAND_MS = 25,         /* what a piece should take */
    BAND_GROWTH = 4,      /* a piece over the one before it, at most: parts of an image differ */
    BAND_FIRST = 1 << 15, /* pixels, or list entries: 2 to 200 ms on two cores in software */
};

struct bands {
    uint64_t first, count; /* the current piece */
    uint64_t end, granule, next_count;
};

/* All of `total` units, in one piece where first_count is 0. Pieces begin at multiples of the
 * granule. */
struct bands bands_begin(uint64_t total, uint64_t first_count, uint64_t granule);
/* Sets the next piece; false when there is none. */
bool bands_next(struct bands *bands);
bool bands_is_last(const struct bands *bands); /* of the current piece */
/* The current piece took so long; others were not served in it. */
void bands_took(struct bands *bands, double ms);
/* A piece of so many units did. */
void bands_learn(struct bands *bands, uint64_t count, double ms);

#endif

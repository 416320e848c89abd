/* SPDX-License-Identifier: MIT */
/* Sub-allocation: which elements of a growing pool are in use. First fit, free neighbours merge.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_RANGES_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_RANGES_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

struct shadow_range {
    uint64_t first, count;
};

struct shadow_ranges {         /* zeroed = an empty pool of capacity 0 */
    struct shadow_range *free; /* sorted by first, never touching */
    size_t free_count, free_capacity;
    uint64_t capacity;
};

void shadow_ranges_finish(struct shadow_ranges *ranges);

/* False if no free range is long enough; *taken is then unchanged. A count of 0 takes an empty
 * range. */
bool shadow_ranges_take(struct shadow_ranges *ranges, uint64_t count, struct shadow_range *taken);
/* Gives a taken range, or a part of one, back. *range becomes empty. */
MUST_CHECK bool shadow_ranges_free(struct shadow_ranges *ranges, struct shadow_range *range,
                                   struct error *err);
/* The capacity with which a range of count elements would fit. */
uint64_t shadow_ranges_capacity_for(const struct shadow_ranges *ranges, uint64_t count);
/* The capacity with which ranges of so many elements would fit that are taken in this order. */
MUST_CHECK bool shadow_ranges_capacity_for_all(const struct shadow_ranges *ranges,
                                               const uint64_t *counts, size_t count,
                                               uint64_t *capacity, struct error *err);
bool shadow_ranges_is_empty(const struct shadow_ranges *ranges); /* nothing is taken */
/* Gives up the free elements behind the last one that is taken. */
void shadow_ranges_trim(struct shadow_ranges *ranges);
MUST_CHECK bool shadow_ranges_grow(struct shadow_ranges *ranges, uint64_t capacity,
                                   struct error *err);

#endif

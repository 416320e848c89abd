/* SPDX-License-Identifier: MIT */
/* The next slice gets as many units as the pace of the last one allows. */
#include "renderer/window/time_slices.h"

#include <math.h>

static uint64_t round_up(uint64_t count, uint64_t granule)
{
    return (count + granule - 1) / granule * granule;
}

struct time_slices time_slices_begin(uint64_t total, uint64_t first_count, uint64_t granule)
{
    return (struct time_slices){.end = total,
                                .granule = granule,
                                .next_count = first_count ? round_up(first_count, granule) : total};
}

/* A rest of less than half a slice goes with the last one. */
bool time_slices_next(struct time_slices *slices)
{
    slices->first += slices->count;
    uint64_t rest = slices->end - slices->first;
    slices->count = rest <= slices->next_count + slices->next_count / 2 ? rest : slices->next_count;
    return rest > 0;
}

bool time_slices_is_last(const struct time_slices *slices)
{
    return slices->first + slices->count == slices->end;
}

void time_slices_learn(struct time_slices *slices, uint64_t count, double ms)
{
    double factor = fmin(TIME_SLICE_MS / fmax(ms, 1e-3), TIME_SLICE_GROWTH);
    slices->next_count = round_up((uint64_t)fmax((double)count * factor, 1), slices->granule);
}

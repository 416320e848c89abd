/* SPDX-License-Identifier: MIT */
/* Pieces of equal time. */
#include "renderer/window/bands.h"

#include <math.h>

static uint64_t round_up(uint64_t count, uint64_t granule)
{
    return (count + granule - 1) / granule * granule;
}

struct bands bands_begin(uint64_t total, uint64_t first_count, uint64_t granule)
{
    return (struct bands){.end = total,
                          .granule = granule,
                          .next_count = first_count ? round_up(first_count, granule) : total};
}

/* What were left behind the last piece, less than half of one, goes with it. */
bool bands_next(struct bands *bands)
{
    bands->first += bands->count;
    uint64_t rest = bands->end - bands->first;
    bands->count = rest <= bands->next_count + bands->next_count / 2 ? rest : bands->next_count;
    return rest > 0;
}

bool bands_is_last(const struct bands *bands)
{
    return bands->first + bands->count == bands->end;
}

void bands_took(struct bands *bands, double ms)
{
    bands_learn(bands, bands->count, ms);
}

void bands_learn(struct bands *bands, uint64_t count, double ms)
{
    double factor = fmin(BAND_MS / fmax(ms, 1e-3), BAND_GROWTH);
    bands->next_count = round_up((uint64_t)fmax((double)count * factor, 1), bands->granule);
}

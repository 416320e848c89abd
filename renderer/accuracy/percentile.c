/* SPDX-License-Identifier: MIT */
/* Selection by counting, 16 bits at a time. */
#include "renderer/accuracy/percentile.h"

#include <math.h>
#include <string.h>

uint32_t percentile_bits(double value)
{
    float rounded = (float)value;
    uint32_t bits;
    memcpy(&bits, &rounded, sizeof bits);
    return bits;
}

double percentile_from_bits(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

uint64_t percentile_rank(uint64_t count, uint64_t one_in)
{
    return count - count / one_in;
}

uint32_t percentile_code(const uint64_t counts[PERCENTILE_CODES], uint64_t *rank)
{
    uint32_t code = 0;
    while (code + 1 < PERCENTILE_CODES && counts[code] < *rank)
        *rank -= counts[code++];
    return code;
}

double percentile_select(const float *values, size_t count, uint64_t rank, uint64_t *counts)
{
    if (!rank)
        return 0;
    memset(counts, 0, PERCENTILE_CODES * sizeof *counts);
    for (size_t i = 0; i < count; i++)
        if (!isnan(values[i]))
            counts[percentile_bits((double)values[i]) >> 16]++;
    uint32_t upper = percentile_code(counts, &rank);
    memset(counts, 0, PERCENTILE_CODES * sizeof *counts);
    for (size_t i = 0; i < count; i++) {
        uint32_t bits = percentile_bits((double)values[i]);
        if (!isnan(values[i]) && bits >> 16 == upper)
            counts[bits & 0xffff]++;
    }
    return percentile_from_bits(upper << 16 | percentile_code(counts, &rank));
}

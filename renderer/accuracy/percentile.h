/* SPDX-License-Identifier: MIT */
/* Percentiles of values >= 0, by a histogram of the upper half of their f32 bits and then of the
 * lower half. They are exact in f32, and take two passes and no sorted copy. */
#ifndef VITRAIL_RENDERER_ACCURACY_PERCENTILE_H
#define VITRAIL_RENDERER_ACCURACY_PERCENTILE_H

#include <stddef.h>
#include <stdint.h>

enum { PERCENTILE_CODES = 1 << 16 };

/* Bits of the nearest f32; as numbers they are in the order of the values. Above FLT_MAX they are
 * those of infinity. */
uint32_t percentile_bits(double value);
double percentile_from_bits(uint32_t bits);

/* Nearest rank, from 1, of the value that all but one in `one_in` do not exceed: 1000 for the
 * 99.9th percentile. 0 when count is. */
uint64_t percentile_rank(uint64_t count, uint64_t one_in);

/* The code of the rank-th smallest value, given how often each code occurs; *rank becomes its rank
 * among the values of that code. */
uint32_t percentile_code(const uint64_t counts[PERCENTILE_CODES], uint64_t *rank);

/* The rank-th smallest, from 1, of values in memory that are not NaN; 0 for rank 0. counts: scratch
 * of PERCENTILE_CODES. */
double percentile_select(const float *values, size_t count, uint64_t rank, uint64_t *counts);

#endif

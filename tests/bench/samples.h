/* SPDX-License-Identifier: MIT */
/* Series of measured times and what is said of them: median, spread, comparison, growth. */
#ifndef VITRAIL_TESTS_BENCH_SAMPLES_H
#define VITRAIL_TESTS_BENCH_SAMPLES_H

#include <stddef.h>

enum { SAMPLES_MAX = 1024 };

struct samples { /* zeroed = empty; plain memory, grown as needed */
    double *values;
    size_t count, capacity;
};

void samples_add(struct samples *samples, double value);
void samples_finish(struct samples *samples);

struct summary {
    double median, mad, p95; /* mad: median of the absolute deviations from the median */
};
struct summary samples_summary(const struct samples *samples); /* NANs when empty */

/* Two-sided p of the Mann-Whitney U test (Mann and Whitney 1947, "On a Test of Whether one of Two
 * Random Variables is Stochastically Larger than the Other"), normal approximation with ties: small
 * means the series differ in rank. 1 when either has fewer than two samples. */
double samples_difference_p(const struct samples *a, const struct samples *b);

/* Exponent e of the least-squares fit y = c x^e through points with x, y > 0; NAN below two. */
double fit_exponent(const double *x, const double *y, size_t count);
/* Coefficient of determination of the straight line through the points. */
double fit_line_r2(const double *x, const double *y, size_t count);

#endif

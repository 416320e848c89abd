/* SPDX-License-Identifier: MIT */
/* A sum in f64 that keeps what each addition rounds away. */
#ifndef VITRAIL_RENDERER_ACCURACY_SUM_H
#define VITRAIL_RENDERER_ACCURACY_SUM_H

#include <math.h>

/* Neumaier 1974, "Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen",
 * algorithm IV: the error stays at one rounding of the result, however many terms there are.
 * Zeroed = 0. */
struct sum {
    double total, rest;
};

static inline void sum_add(struct sum *sum, double term)
{
    double total = sum->total + term;
    if (fabs(sum->total) >= fabs(term))
        sum->rest += (sum->total - total) + term;
    else
        sum->rest += (term - total) + sum->total;
    sum->total = total;
}

static inline double sum_value(const struct sum *sum)
{
    return sum->total + sum->rest;
}

#endif

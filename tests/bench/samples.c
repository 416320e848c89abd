/* SPDX-License-Identifier: MIT */
/* Statistics of measured times. */
#include "tests/bench/samples.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void samples_add(struct samples *samples, double value)
{
    if (samples->count == samples->capacity) {
        samples->capacity = samples->capacity ? 2 * samples->capacity : 16;
        samples->values = realloc(samples->values, samples->capacity * sizeof *samples->values);
        assert(samples->values);
    }
    samples->values[samples->count++] = value;
}

void samples_finish(struct samples *samples)
{
    free(samples->values);
    *samples = (struct samples){0};
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Linear between the ranks; sorts its input. */
static double quantile(double *values, size_t count, double q)
{
    qsort(values, count, sizeof *values, compare);
    double rank = q * (double)(count - 1);
    size_t low = (size_t)rank;
    size_t high = low + 1 < count ? low + 1 : low;
    return values[low] + (values[high] - values[low]) * (rank - (double)low);
}

struct summary samples_summary(const struct samples *samples)
{
    size_t count = samples->count;
    if (!count)
        return (struct summary){NAN, NAN, NAN};
    double *sorted = malloc(count * sizeof *sorted);
    assert(sorted);
    memcpy(sorted, samples->values, count * sizeof *sorted);
    struct summary s = {.median = quantile(sorted, count, 0.5),
                        .p95 = quantile(sorted, count, 0.95)};
    for (size_t i = 0; i < count; i++)
        sorted[i] = fabs(sorted[i] - s.median);
    s.mad = quantile(sorted, count, 0.5);
    free(sorted);
    return s;
}

/* How many of the samples are at most, or less than, the value. */
static void rank_in(const struct samples *samples, double value, double *below, double *equal)
{
    *below = *equal = 0;
    for (size_t i = 0; i < samples->count; i++) {
        *below += samples->values[i] < value;
        *equal += samples->values[i] == value;
    }
}

double samples_difference_p(const struct samples *a, const struct samples *b)
{
    double n = (double)a->count, m = (double)b->count, u = 0, ties = 0;
    if (a->count < 2 || b->count < 2)
        return 1;
    for (size_t i = 0; i < a->count; i++) {
        double below, equal, below_own, equal_own;
        rank_in(b, a->values[i], &below, &equal);
        rank_in(a, a->values[i], &below_own, &equal_own);
        double run = equal + equal_own; /* each tied group adds t^3 - t, shared by its members */
        u += below + 0.5 * equal;
        ties += run * run - 1;
    }
    for (size_t i = 0; i < b->count; i++) {
        double below, equal, below_own, equal_own;
        rank_in(a, b->values[i], &below, &equal);
        rank_in(b, b->values[i], &below_own, &equal_own);
        ties += (equal + equal_own) * (equal + equal_own) - 1;
    }
    double total = n + m;
    double variance = n * m / 12 * (total + 1 - ties / (total * (total - 1)));
    if (variance <= 0)
        return 1;
    double z = fmax(fabs(u - n * m / 2) - 0.5, 0) / sqrt(variance);
    return erfc(z / sqrt(2));
}

struct line {
    double slope, r2;
};

static struct line fit_line(const double *x, const double *y, size_t count)
{
    double n = (double)count, mean_x = 0, mean_y = 0, xx = 0, xy = 0, yy = 0;
    for (size_t i = 0; i < count; i++) {
        mean_x += x[i] / n;
        mean_y += y[i] / n;
    }
    for (size_t i = 0; i < count; i++) {
        xx += (x[i] - mean_x) * (x[i] - mean_x);
        xy += (x[i] - mean_x) * (y[i] - mean_y);
        yy += (y[i] - mean_y) * (y[i] - mean_y);
    }
    return count < 2 ? (struct line){NAN, NAN} : (struct line){xy / xx, xy * xy / (xx * yy)};
}

double fit_exponent(const double *x, const double *y, size_t count)
{
    double log_x[SAMPLES_MAX], log_y[SAMPLES_MAX];
    size_t kept = 0;
    for (size_t i = 0; i < count && kept < SAMPLES_MAX; i++) {
        if (!(x[i] > 0) || !(y[i] > 0))
            continue;
        log_x[kept] = log(x[i]);
        log_y[kept++] = log(y[i]);
    }
    return fit_line(log_x, log_y, kept).slope;
}

double fit_line_r2(const double *x, const double *y, size_t count)
{
    return fit_line(x, y, count).r2;
}

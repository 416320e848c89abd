/* SPDX-License-Identifier: MIT */
/* What the tests of extremes share: a measured error is logged and must keep its tolerance. A
 * failed check fails the cmocka test that called. Thread: the GL thread. */
#ifndef VITRAIL_TESTS_SUPPORT_EXTREME_CHECKS_H
#define VITRAIL_TESTS_SUPPORT_EXTREME_CHECKS_H

#include "renderer/image/image.h"

struct extreme_row { /* one row of the table in docs/reference/accuracy.md, "Extremes" */
    const char *scene, *technique, *metric;
    double tolerance;
};

/* Logs the error, says it on stdout, and fails the test when it is not within the tolerance. */
void extreme_expect(const struct extreme_row *row, double error);

/* RMSE over channels 0 to 2 of two F32 images of one size, divided by the mean of b: relative to
 * how bright the picture is. INFINITY where a value is not finite. */
double extreme_rmse(const struct image *a, const struct image *b);

/* Whether a slow full version was asked for: the environment variable VITRAIL_EXTREMES is "full".
 */
bool extreme_is_full(void);

#endif

/* SPDX-License-Identifier: MIT */
/* Checks of the tests of extremes. */
#include "tests/support/extreme_checks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/accuracy/metrics.h"
#include "tests/support/accuracy_log.h"

void extreme_expect(const struct extreme_row *row, double error)
{
    bool is_pass = error <= row->tolerance;
    accuracy_log(&(struct accuracy_result){.suite = "extremes",
                                           .scene = row->scene,
                                           .technique = row->technique,
                                           .metric = row->metric,
                                           .error = error,
                                           .tolerance = row->tolerance,
                                           .is_pass = is_pass});
    print_message("%s, %s: %s %.3g (%.3g)\n", row->scene, row->technique, row->metric, error,
                  row->tolerance);
    if (!is_pass)
        fail_msg("%s, %s: %s is %.6g, the tolerance is %.6g", row->scene, row->technique,
                 row->metric, error, row->tolerance);
}

double extreme_rmse(const struct image *a, const struct image *b)
{
    struct image_metrics metrics;
    struct error err = {0};
    struct image_metrics_desc desc = {.image = a, .reference = b, .channels = 7};
    if (!image_metrics_measure(&desc, &metrics, &err))
        fail_msg("%s", err.message);
    assert_true(metrics.overall.mean_reference > 0); /* a black picture proves nothing */
    if (metrics.nonfinite_image || metrics.nonfinite_reference)
        return INFINITY;
    return metrics.overall.rmse / metrics.overall.mean_reference;
}

bool extreme_is_full(void)
{
    const char *wish = getenv("VITRAIL_EXTREMES");
    return wish && strcmp(wish, "full") == 0;
}

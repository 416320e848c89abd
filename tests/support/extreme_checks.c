/* SPDX-License-Identifier: MIT */
/* Checks of the tests of extremes. */
#include "tests/support/extreme_checks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

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
    assert_int_equal(a->component, IMAGE_F32);
    assert_int_equal(image_size_bytes(a), image_size_bytes(b));
    const float *p = a->pixels, *q = b->pixels;
    size_t pixels = (size_t)a->width_px * (size_t)a->height_px, channels = (size_t)a->channels;
    double apart = 0, bright = 0;
    for (size_t i = 0; i < pixels; i++) {
        for (size_t c = 0; c < 3; c++) {
            double x = (double)p[i * channels + c], y = (double)q[i * channels + c];
            apart += (x - y) * (x - y);
            bright += y * y;
        }
    }
    assert_true(bright > 0); /* a black picture proves nothing */
    double rmse = sqrt(apart / bright);
    return isfinite(rmse) ? rmse : INFINITY;
}

bool extreme_is_full(void)
{
    const char *wish = getenv("VITRAIL_EXTREMES");
    return wish && strcmp(wish, "full") == 0;
}

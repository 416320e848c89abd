/* SPDX-License-Identifier: MIT */
/* What tests measured, one JSON object per line of accuracy/results.jsonl in the build folder, for
 * the report that ./check makes of it. Thread: any; lines of programs that run side by side do not
 * mix. */
#ifndef VITRAIL_TESTS_SUPPORT_ACCURACY_LOG_H
#define VITRAIL_TESTS_SUPPORT_ACCURACY_LOG_H

#include <stdbool.h>

struct accuracy_result {
    const char *suite;      /* required: the test program, "extremes" */
    const char *scene;      /* required: what was looked at, "10,000 layers of 0.999" */
    const char *technique;  /* required: "deep", "deep-linked", "raytraced", ... */
    const char *metric;     /* required: with its unit, "relative error of T" */
    double error;           /* measured; not finite becomes null */
    double tolerance;       /* promised */
    double ms;              /* of the frame measured; 0 = not measured */
    bool is_pass;           /* error is within tolerance, and whatever else was asked */
    const char *image;      /* PNG, relative to the build folder; NULL = none */
    const char *difference; /* likewise: the image against its reference */
};

/* A result that cannot be written is said on stderr and fails nothing. */
void accuracy_log(const struct accuracy_result *result);

#endif

/* SPDX-License-Identifier: MIT */
/* Haze in the demo scene from several cameras: what it costs over the frame without it, and how far
 * its picture is off one with many slices. Thread: GL. */
#ifndef VITRAIL_TESTS_BENCH_CHAPEL_HAZE_H
#define VITRAIL_TESTS_BENCH_CHAPEL_HAZE_H

#include "tests/bench/bench.h"

/* `deep` with the slices of the default, both figures with their bounds. */
MUST_CHECK bool chapel_haze_run(struct bench *bench, struct error *err);

#endif

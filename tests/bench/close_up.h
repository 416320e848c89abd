/* SPDX-License-Identifier: MIT */
/* Light through smoke from nearby (Lindbeck 2015, figure 3.3b): layers of smoke before the camera,
 * and spots around, of which each layer takes its share. Thread: GL. */
#ifndef VITRAIL_TESTS_BENCH_CLOSE_UP_H
#define VITRAIL_TESTS_BENCH_CLOSE_UP_H

#include "tests/bench/bench.h"

/* Frames of 5 and of 25 lights beside those of the source, which walks a list of each light at each
 * step of each pixel's ray: times, steps and lookups of both. */
MUST_CHECK bool close_up_run(struct bench *bench, struct error *err);

#endif

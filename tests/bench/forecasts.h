/* SPDX-License-Identifier: MIT */
/* What suites share that hold times against forecasts. Thread: GL. */
#ifndef VITRAIL_TESTS_BENCH_FORECASTS_H
#define VITRAIL_TESTS_BENCH_FORECASTS_H

#include "renderer/forecast/forecast.h"
#include "tests/bench/bench.h"
#include "tests/support/render_support.h"

/* What a forecast goes by. */
MUST_CHECK bool forecasts_count_work(const struct rig_scene *rig, const struct view *view,
                                     struct workload *workload, struct error *err);

/* What `auto` takes at first on a device of that speed. */
MUST_CHECK bool forecasts_choose(const struct rig_scene *rig, const struct view *view,
                                 const struct device_speed *speed, enum shadow_technique *chosen,
                                 struct error *err);

/* The least of two frames after the first, which compiles. is_cold: each builds its shadows.
 * report: of the last frame. */
MUST_CHECK bool forecasts_time_view(struct bench *bench, const struct rig_scene *rig,
                                    const struct view *view, bool is_cold, double *least_ms,
                                    struct frame_report *report, struct error *err);

/* How far from 1 the ratios are, either way. */
double forecasts_off(double ratio);

#endif

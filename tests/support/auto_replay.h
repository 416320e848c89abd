/* SPDX-License-Identifier: MIT */
/* The rule of `shadows: auto` over recorded times: what it would have chosen, without a stopwatch.
 * Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_AUTO_REPLAY_H
#define VITRAIL_TESTS_SUPPORT_AUTO_REPLAY_H

#include <jansson.h>

#include "renderer/cost/auto_technique.h"

enum { REPLAY_FRAMES = 4, REPLAY_CASES_MAX = 128, REPLAY_LATER = 10, REPLAY_TIMED = 3 };

/* A view, counted, and what its frames took by each technique, shadows kept. */
struct replay_case {
    char name[80];
    struct workload workload;
    int samples;
    bool maps_stay;                          /* from frame to frame: they fit their budget */
    double ms[SHADOWS_COUNT][REPLAY_FRAMES]; /* alone on the machine: calibrate_alone_ms */
};

struct replay {
    struct device_speed speed; /* of the device that drew them */
    struct replay_case cases[REPLAY_CASES_MAX];
    int count;
};

json_t *replay_case_to_json(const struct replay_case *one);
json_t *replay_speed_to_json(const struct device_speed *speed);
/* {"speed": ..., "cases": [...]}. */
MUST_CHECK bool replay_from_json(struct replay *replay, const json_t *json, struct error *err);

/* What may go wrong in a replay. Zeroed = nothing. */
struct replay_trouble {
    double slower;  /* all frames take so many times as long; 0 means 1 */
    bool is_busy;   /* no technique is timed while nobody asks: somebody always does */
    int outlier_at; /* this frame, from 1 on, takes ten times as long; 0: none does */
};

/* How many times longer than the fastest technique the chosen ones take. */
struct replay_result {
    double first;     /* of the first frame, by its forecast */
    double later;     /* of the frame after REPLAY_LATER of them, */
    double later_off; /* whose forecast is off by this factor, either way, >= 1 */
    enum shadow_technique first_technique, later_technique;
};
/* The frames teach `learned`, whose earlier observations count for the first; between two of them
 * the runner-up is timed, where there is one. */
struct replay_result replay_run(const struct replay *replay, const struct replay_case *one,
                                struct learning *learned, const struct replay_trouble *trouble);

#endif

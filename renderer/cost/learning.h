/* SPDX-License-Identifier: MIT */
/* What frames really took corrects what renderer/cost/technique_forecast says they take: each kind
 * of work and each family of techniques by a factor of its own, and each view that was drawn before
 * by what it took. Pure functions over plain values. Thread: any.
 *
 * The factors are estimated by recursive least squares with forgetting (an extended Kalman filter:
 * Kalman 1960, "A New Approach to Linear Filtering and Prediction Problems") in the logarithm of
 * the time, where a factor of two weighs the same up and down. What is far from the expectation
 * counts for no more than a limit (Huber 1964, "Robust Estimation of a Location Parameter"), which
 * doubles with each frame that agrees with the one before: one frame turns nothing, three do. */
#ifndef VITRAIL_RENDERER_COST_LEARNING_H
#define VITRAIL_RENDERER_COST_LEARNING_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/shadow_technique.h"
#include "renderer/forecast/forecast.h"

enum {
    LEARNING_FAMILIES = SHADOW_FAMILY_NONE, /* pictures without shadows are of that of maps */
    LEARNING_STATES = FORECAST_TERM_COUNT + LEARNING_FAMILIES,
    LEARNING_VIEWS_MAX = 256, /* the one not taught for longest makes room */
};

/* Observations that were cut, in a row. */
struct learning_run {
    int32_t count;  /* above 0 all were too long, below too short */
    int32_t passed; /* 1: the last one was so odd that it or the one before was passed over */
};

struct learning_view {
    uint64_t key;   /* of a view and a technique; 0: no entry */
    double off;     /* natural logarithm of what it takes over the forecast of the factors */
    uint64_t clock; /* of its last observation */
    uint32_t count; /* observations that were not passed over */
    struct learning_run run;
    uint32_t is_shown; /* 1: pictures of the view were last drawn by the technique */
};

/* Copied, compared and kept as it is; learning_init makes one that corrects nothing. */
struct learning {
    double factor[LEARNING_STATES];                 /* natural logarithms: terms, then families */
    double doubt[LEARNING_STATES][LEARNING_STATES]; /* covariance of the factors */
    struct learning_run run[LEARNING_FAMILIES];
    uint64_t clock; /* observations so far */
    struct learning_view views[LEARNING_VIEWS_MAX];
};

void learning_init(struct learning *learning);

/* A frame, or one that may be drawn. */
struct learning_case {
    double terms[FORECAST_TERM_COUNT]; /* ms, of technique_forecast_terms */
    enum shadow_technique technique;
    bool is_left_out; /* the technique cannot draw the view: it is compared with none */
    uint64_t view;    /* key of what is drawn, whatever the camera; 0: none */
};

struct learning_answer {
    double ms;
    double doubt;          /* standard deviation of the natural logarithm of ms */
    uint32_t observations; /* of this view by this technique */
    bool is_shown;         /* its pictures were last drawn by it */
};
struct learning_answer learning_expect(const struct learning *learning,
                                       const struct learning_case *frame);

/* The frame took so long, alone on the machine. What is no positive number is passed over. */
void learning_teach(struct learning *learning, const struct learning_case *frame, double taken_ms);

/* Pictures of the view are drawn by that technique from now on. Without effect while no observation
 * of the two is known. */
void learning_show(struct learning *learning, const struct learning_case *frame);

/* Whether every number is one that teaching can have made: of what was read from a file. */
bool learning_is_sound(const struct learning *learning);

#endif

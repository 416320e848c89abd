/* SPDX-License-Identifier: MIT */
/* Costs of frames, and the largest scale that holds a budget by them. */
#include "server/views/live_scale.h"

#include <math.h>

static const double scales[] = {1, 0.75, 0.625, 0.5, 0.375, 0.3125, 0.25, 0.1875, 0.125, 0.1};
enum { SCALES = sizeof scales / sizeof scales[0] };

/* A larger scale is taken only when it promises to stay this far inside the budget. */
static const double HEADROOM = 0.8;

/* A frame that takes so many times the budget is not waited out: it may have been delayed, but
 * where the camera has turned to what costs more, the next two would take as long. */
static const double FAR_OVER = 1.5;

/* More than this share of the least cost is not believed to be fixed: the camera may have turned to
 * what costs more, and a larger picture must not be thought to be had for nothing. */
static const double FIXED_MOST = 0.5;

/* Pairs of scales that the fixed part is a mean of; older ones fade. */
enum { FIXED_PAIRS = 4 };

static double middle(const double values[LIVE_SCALE_COSTS])
{
    double a = values[0], b = values[1], c = values[2];
    return fmax(fmin(a, b), fmin(fmax(a, b), c));
}

/* From the middle costs of two scales, one after the other. */
static void learn_fixed(struct live_scale *costs)
{
    double now = costs->scale * costs->scale, then = costs->before_scale * costs->before_scale;
    double cost_ms = middle(costs->costs_ms);
    double fixed_ms = (costs->before_ms * now - cost_ms * then) / (now - then);
    double most_ms = FIXED_MOST * fmin(costs->before_ms, cost_ms);
    fixed_ms = fmin(fmax(fixed_ms, 0), most_ms);
    costs->fixed_count += costs->fixed_count < FIXED_PAIRS;
    costs->fixed_ms += (fixed_ms - costs->fixed_ms) / costs->fixed_count;
}

static double fixed_of(const struct live_scale *costs, double cost_ms)
{
    return fmin(costs->fixed_ms, FIXED_MOST * cost_ms);
}

static void take_cost(struct live_scale *costs, double scale, double cost_ms)
{
    if (scale != costs->scale) {
        costs->before_ms = costs->run >= LIVE_SCALE_COSTS ? middle(costs->costs_ms) : 0;
        costs->before_scale = costs->scale;
        costs->scale = scale;
        costs->run = 0;
    }
    int at = (int)(costs->count++ % LIVE_SCALE_COSTS);
    costs->costs_ms[at] = cost_ms;
    costs->scales[at] = scale;
    if (++costs->run == LIVE_SCALE_COSTS && costs->before_ms > 0)
        learn_fixed(costs);
}

/* What of a cost grows with the pixels, at full scale. */
static double growing_part(const struct live_scale *costs, double scale, double cost_ms)
{
    return (cost_ms - fixed_of(costs, cost_ms)) / (scale * scale);
}

/* The middle one of three frames; the newest while there are fewer. */
static double growing_ms(const struct live_scale *costs, double scale, double cost_ms)
{
    double growing[LIVE_SCALE_COSTS];
    if (costs->count < LIVE_SCALE_COSTS)
        return growing_part(costs, scale, cost_ms);
    for (int i = 0; i < LIVE_SCALE_COSTS; i++)
        growing[i] = growing_part(costs, costs->scales[i], costs->costs_ms[i]);
    return middle(growing);
}

double live_scale_next(struct live_scale *costs, double scale, double cost_ms, double budget_ms,
                       double min_scale)
{
    take_cost(costs, scale, cost_ms);
    double whole_ms = growing_ms(costs, scale, cost_ms);
    if (cost_ms > FAR_OVER * budget_ms)
        whole_ms = fmax(whole_ms, growing_part(costs, scale, cost_ms));
    double chosen = scales[SCALES - 1];
    for (int i = SCALES - 1; i >= 0; i--) {
        double expected_ms = costs->fixed_ms + whole_ms * scales[i] * scales[i];
        if (expected_ms <= budget_ms * (scales[i] > scale ? HEADROOM : 1))
            chosen = scales[i];
    }
    return fmax(chosen, min_scale);
}

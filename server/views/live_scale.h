/* SPDX-License-Identifier: MIT */
/* The scale of a view's moving frames, by what the last ones took. Thread: one at a time. */
#ifndef VITRAIL_SERVER_VIEWS_LIVE_SCALE_H
#define VITRAIL_SERVER_VIEWS_LIVE_SCALE_H

#include <stdint.h>

enum { LIVE_SCALE_COSTS = 3 };

struct live_scale {                    /* zeroed: no frame was made */
    double costs_ms[LIVE_SCALE_COSTS]; /* of the last frames */
    double scales[LIVE_SCALE_COSTS];   /* theirs */
    uint32_t count;                    /* of all frames */
    double scale;                      /* of the last one */
    uint32_t run;                      /* of frames since that scale was taken */
    double before_ms, before_scale;    /* the middle cost of the scale before; 0: not known */
    double fixed_ms;                   /* what a frame costs at any scale; 0 until it is known */
    uint32_t fixed_count;              /* of pairs of scales that it is the mean of */
};

/* A frame of `scale` took cost_ms: the scale of the next, so that it takes no more than budget_ms.
 * One of few, so that render targets are not created for each frame, or min_scale. A frame that
 * something else delayed a little changes nothing: three frames are looked at, but for one that
 * took half as long again as the budget. Costs of two scales, one after the other, tell what part
 * of them does not grow with the picture. */
double live_scale_next(struct live_scale *costs, double scale, double cost_ms, double budget_ms,
                       double min_scale);

#endif

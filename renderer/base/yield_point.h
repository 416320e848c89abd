/* SPDX-License-Identifier: MIT */
/* Cooperative preemption. A long frame has yield points, at which nothing of it is half done. There
 * it asks whether urgent frames wait; if so they are made first, and it goes on as if nothing had
 * been. Every layer that has yield points takes this struct, and a layer that has more to put back
 * than the layer above wraps the one that it was given. */
#ifndef VITRAIL_RENDERER_BASE_YIELD_POINT_H
#define VITRAIL_RENDERER_BASE_YIELD_POINT_H

#include <assert.h>

#include "protocol/error.h"

struct yield_point {
    void *context;
    bool (*should_yield)(void *context); /* required; any thread, often */
    /* Required; on the frame's thread, while nothing else of the frame runs. When it returns, all
     * that its giver promises is as before. False ends the frame: err says why, or is left alone
     * where the frame is merely not wanted any more. */
    bool (*run_urgent)(void *context, struct error *err);
    /* Optional; any thread, often: true ends rays within a tile, without a yield. */
    bool (*is_unwanted)(void *context);
};

/* point: NULL never yields. */
static inline bool yield_point_is_due(const struct yield_point *point)
{
    return point && point->should_yield(point->context);
}

static inline bool yield_point_is_unwanted(const struct yield_point *point)
{
    return point && point->is_unwanted && point->is_unwanted(point->context);
}

/* For a point that is due. ERROR_OVERLOADED where no other reason is given. */
MUST_CHECK static inline bool yield_point_run(const struct yield_point *point, struct error *err)
{
    assert(point);
    return point->run_urgent(point->context, err) ||
           error_set(err, ERROR_OVERLOADED, "the frame is not wanted any more");
}

#endif

/* SPDX-License-Identifier: MIT */
/* The exposure of a frame whose request leaves it open. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_METERING_H
#define VITRAIL_SERVER_WORKER_METERING_H

#include "protocol/frame_stats.h"
#include "protocol/render_request.h"
#include "renderer/renderer.h"

struct metering { /* zeroed: the request said one, or the answer needs none */
    bool is_done;
    struct exposure_reading reading;
};

/* Meters where the request asks for it and the answer is a colour as a screen shows it, and puts
 * the exposure into the request. */
MUST_CHECK bool metering_resolve(struct renderer *renderer, const struct view *view,
                                 enum image_format format, struct render_request *request,
                                 struct metering *metering, struct error *err);
/* What it took, as a pass of the frame that it was for. */
void metering_report(const struct metering *metering, struct frame_report *report);
/* The exposure that the answer has, if any. */
void metering_tell(const struct render_request *request, enum image_format format,
                   struct frame_stats *stats);

#endif

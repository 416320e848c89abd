/* SPDX-License-Identifier: MIT */
/* What `auto` becomes, before the frame is drawn: what is behind the picture is mapped with it. */
#include "server/worker/metering.h"

static bool shows_color(const struct render_request *request, enum image_format format)
{
    return format != IMAGE_FORMAT_EXR && request->outputs & 1u << REQUEST_OUTPUT_COLOR;
}

bool metering_resolve(struct renderer *renderer, const struct view *view, enum image_format format,
                      struct render_request *request, struct metering *metering, struct error *err)
{
    if (!request->meters_exposure || !shows_color(request, format))
        return true;
    if (!renderer_meter(renderer, request->scene, view, &metering->reading, err))
        return false;
    metering->is_done = true;
    request->exposure_ev = (double)metering->reading.ev;
    request->meters_exposure = false;
    return true;
}

void metering_report(const struct metering *metering, struct frame_report *report)
{
    const struct exposure_reading *reading = &metering->reading;
    if (!metering->is_done)
        return;
    if (reading->is_kept) {
        report_add_reused(report, "exposure");
        return;
    }
    report_add_pass(report, "exposure", "exposure_ev is auto", "", reading->ms, REPORT_SHADE);
    report->total_ms += reading->ms;
    report->paused_ms += reading->paused_ms;
}

void metering_tell(const struct render_request *request, enum image_format format,
                   struct frame_stats *stats)
{
    stats->has_exposure = shows_color(request, format);
    stats->exposure_ev = stats->has_exposure ? request->exposure_ev : 0;
}

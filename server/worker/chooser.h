/* SPDX-License-Identifier: MIT */
/* The one chooser: what `auto`, max_error and budget_ms become, from the target, the measured rows
 * that the front sends with the job, forecasts of the evaluated scene, and what earlier frames
 * took. Nothing else in the service chooses: the planner plans what is chosen here. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_CHOOSER_H
#define VITRAIL_SERVER_WORKER_CHOOSER_H

#include <jansson.h>

#include "protocol/frame_stats.h"
#include "protocol/render_request.h"
#include "renderer/renderer.h"
#include "server/base/digest.h"
#include "server/worker/time_estimator.h"

struct chooser_desc {
    struct time_estimator *estimator;      /* required */
    const struct auto_settings *automatic; /* required: the speed of the device */
    const struct renderer_info *info;      /* required */
    /* server/mapping/choice_offer.h; NULL: nothing is left open, or no row was measured */
    const json_t *offer;
    bool is_warm; /* the time that counts is that of a frame whose shadow structures are there
                     already, for a view that is rendered again and again; else of a first frame */
};

/* Where quality asks (request_quality_asks): chooses what it leaves open, writes that into the
 * request, takes max_error and budget_ms out of it, and tells in `promise` what was chosen and why.
 * Rows measured for this view on this device count before those of other views of the scene, and
 * these before the models (renderer/cost/choice.h). Without a target, `auto` becomes the fastest of
 * those that were measured for this view. Else the request stays and the promise is zeroed:
 * chooser_choose_technique follows. */
MUST_CHECK bool chooser_choose(const struct chooser_desc *desc, struct render_request *request,
                               struct frame_promise *promise, struct error *err);

/* Where the view of the request still says `auto`: chooses by forecasts, and has the view point at
 * the choice, which must outlive it. Draws nothing. */
MUST_CHECK bool chooser_choose_technique(struct renderer *renderer, const char *scene,
                                         struct view *view, struct auto_choice *choice,
                                         struct error *err);

/* Of the canonical request as it is drawn, and of the promised error where the image's file tells
 * it, which the front goes by for the picture's tag. */
MUST_CHECK bool chooser_digest(const struct render_request *request,
                               const struct frame_promise *promise, char digest[DIGEST_TEXT_BYTES],
                               struct error *err);

/* What frames of this device and build taught, kept in the file at path (NULL: nowhere). NULL
 * without memory. */
struct time_estimator *chooser_open_estimator(const struct renderer_info *info, const char *path,
                                              struct error *err);

/* The frame is there: its stats tell the promise and whether it was kept, and what it took teaches
 * the next choice. */
void chooser_judge(struct time_estimator *estimator, const struct frame_promise *promise,
                   struct frame_stats *stats);

#endif

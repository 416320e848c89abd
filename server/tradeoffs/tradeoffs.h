/* SPDX-License-Identifier: MIT */
/* The trade-offs of the service: measures them one after the other, keeps them, and offers their
 * rows to the worker, which chooses. Thread: any; owns one thread, which only waits for the worker
 * and writes files.
 *
 * A measurement is a row of small steps (server/worker/measure.h), each one render of the lowest
 * priority, so that whoever waits for a picture waits for one step at most: a band of the reference
 * is cut to about a quarter of a second (or twice what ray tracing needs to get ready, where that
 * is more), every other step is one or two frames, and settings whose frame takes longer than ten
 * seconds are left out. A worker that dies costs the step that it worked on. */
#ifndef VITRAIL_SERVER_TRADEOFFS_TRADEOFFS_H
#define VITRAIL_SERVER_TRADEOFFS_TRADEOFFS_H

#include <jansson.h>
#include <stdbool.h>

#include "protocol/error.h"
#include "protocol/frame_stats.h"
#include "protocol/tradeoff.h"
#include "server/base/log.h"
#include "server/front/resources.h"
#include "server/front/supervisor.h"

struct tradeoffs;

struct tradeoffs_desc {
    const char *state_dir;             /* required */
    const struct log *log;             /* required, borrowed */
    int processors;                    /* that one worker may keep busy */
    struct supervisor *supervisor;     /* required, borrowed until tradeoffs_stop */
    const struct resources *resources; /* required, borrowed */
};

/* Reads what is kept. One that was being measured when the last daemon ended has failed, with what
 * it had; those of scenes that are gone are removed. */
struct tradeoffs *tradeoffs_create(const struct tradeoffs_desc *desc, struct error *err);

/* Ends the measurement at once, keeping what it has. Call it before the supervisor is destroyed,
 * and destroy after that. Both accept NULL. */
void tradeoffs_stop(struct tradeoffs *tradeoffs);
void tradeoffs_destroy(struct tradeoffs *tradeoffs);

/* Queues a measurement and tells its id. Takes the request if it succeeds. ERROR_NOT_FOUND: no such
 * scene; ERROR_TOO_LARGE: more pixels than LIMIT_TRADEOFF_PIXELS; ERROR_OVERLOADED: as many wait
 * already as may. Above LIMIT_TRADEOFFS_KEPT the oldest ended one is forgotten. */
MUST_CHECK bool tradeoffs_submit(struct tradeoffs *tradeoffs, struct tradeoff_request *request,
                                 char id[TRADEOFF_ID_BYTES], struct error *err);

/* A copy on the heap for the caller to tradeoff_finish and free; NULL with ERROR_NOT_FOUND. */
MUST_CHECK struct tradeoff *tradeoffs_get(struct tradeoffs *tradeoffs, const char *id,
                                          struct error *err);
MUST_CHECK json_t *tradeoffs_list(struct tradeoffs *tradeoffs); /* summaries, newest first */

/* The pictures of one, for reading; -1 when there are none. The caller closes it. */
int tradeoffs_open_images(struct tradeoffs *tradeoffs, const char *id);

/* Cancel: what waits or runs ends at once and keeps its results, as partial; what has ended stays
 * as it is. Forget: removes one that has ended (ERROR_CONFLICT while it has not). */
MUST_CHECK bool tradeoffs_cancel(struct tradeoffs *tradeoffs, const char *id, struct error *err);
MUST_CHECK bool tradeoffs_forget(struct tradeoffs *tradeoffs, const char *id, struct error *err);
void tradeoffs_forget_scene(struct tradeoffs *tradeoffs, const char *scene);

/* A picture that is about to be asked for. */
struct tradeoff_view {
    const char *scene; /* required */
    int width_px, height_px;
    const struct request_quality *quality;     /* required */
    const struct request_resources *resources; /* required: the scenes of its parts */
    /* Required: protocol/request_tree.h, malloc'ed; called where something of the scene was
     * measured. */
    char *(*reference_text)(const void *context);
    const void *context;
};

/* What the worker may choose from (server/mapping/choice_offer.h): a new reference in `made`, NULL
 * where the picture's quality leaves nothing open that was measured or is to be estimated. is_warm:
 * the times that count are those of frames whose shadow structures are there already, for a view
 * that is rendered again and again; else those of first frames. */
MUST_CHECK bool tradeoffs_offer(struct tradeoffs *tradeoffs, const struct tradeoff_view *view,
                                bool is_warm, json_t **made, struct error *err);

#endif

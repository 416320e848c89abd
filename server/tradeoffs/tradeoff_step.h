/* SPDX-License-Identifier: MIT */
/* Sends a step of a measurement as a render of the lowest priority, and waits for it. Thread: that
 * of the trade-offs. */
#ifndef VITRAIL_SERVER_TRADEOFFS_TRADEOFF_STEP_H
#define VITRAIL_SERVER_TRADEOFFS_TRADEOFF_STEP_H

#include "server/tradeoffs/tradeoffs_internal.h"

struct step_desc {
    const struct render_request *request; /* required: its quality is the setting */
    json_t *measure;                      /* required, taken: see server/worker/measure.h */
    int reference_fd;                     /* -1: none; borrowed */
    int limit_ms;                         /* from its begin to its end; 0 means a minute */
};

enum step_outcome {
    STEP_DONE,
    STEP_FAILED,      /* problem says why; the next step may well succeed */
    STEP_INTERRUPTED, /* the entry was cancelled, or the server stops: the step is left alone */
};

struct step_result {
    json_t *measured;     /* owned */
    int image_fd;         /* owned; -1: none */
    struct error problem; /* of STEP_FAILED */
};
void step_result_finish(struct step_result *result); /* accepts zeroed and finished */

/* Waits for as long as other work goes before it. */
MUST_CHECK enum step_outcome step_run(struct tradeoffs *tradeoffs, struct tradeoff_entry *entry,
                                      const struct step_desc *desc, struct step_result *result);

#endif

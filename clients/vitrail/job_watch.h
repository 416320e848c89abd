/* SPDX-License-Identifier: MIT */
/* Waiting for a job of the server, with progress, and what came of it. */
#ifndef VITRAIL_CLIENTS_VITRAIL_JOB_WATCH_H
#define VITRAIL_CLIENTS_VITRAIL_JOB_WATCH_H

#include <jansson.h>

#include "clients/vitrail/session.h"

struct job_watch {
    struct session *session; /* required */
    const char *path;        /* required: of the job */
    const char *noun;        /* required: for errors, as in "the job" */
    const char *parts;       /* required: the member whose counts are shown: "frames", "tiles" */
};

/* A member of a job that is a text, or "". */
const char *job_text(const json_t *job, const char *key);
bool job_has_ended(const json_t *job);

/* The job, owned by the caller, once it has ended or waits for somebody: to resume it, or to make
 * an end of what it waits for. NULL with failure, also after a signal, which leaves the job as it
 * is. */
json_t *job_watch_wait(const struct job_watch *watch, struct failure *failure);

/* True: all of it is done. Else why not, with EXIT_CODE_TEMPORARY where the job can go on, and
 * EXIT_CODE_REFUSED where parts failed or it was cancelled. */
bool job_watch_judge(const struct job_watch *watch, const json_t *job, struct failure *failure);

#endif

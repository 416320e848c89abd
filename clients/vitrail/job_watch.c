/* SPDX-License-Identifier: MIT */
/* Jobs are looked at twice a second. */
#include "clients/vitrail/job_watch.h"

#include <string.h>

#include "clients/vitrail/json_text.h"

enum { POLL_MS = 500 };

const char *job_text(const json_t *job, const char *key)
{
    const char *text = json_string_value(json_object_get(job, key));
    return text ? text : "";
}

bool job_has_ended(const json_t *job)
{
    return json_is_string(json_object_get(job, "ended"));
}

static bool is_in_state(const json_t *job, const char *state)
{
    return strcmp(job_text(job, "state"), state) == 0;
}

static bool is_paused(const json_t *job)
{
    return json_is_true(json_object_get(job, "paused"));
}

/* Paused by itself, or waiting for a job that failed: both say why. */
static bool waits_for_somebody(const json_t *job)
{
    return (is_paused(job) || is_in_state(job, "waiting")) &&
           json_is_object(json_object_get(job, "problem"));
}

static void show(const struct job_watch *watch, const json_t *job)
{
    const json_t *parts = json_object_get(job, watch->parts);
    json_int_t ended = json_integer_value(json_object_get(parts, "done")) +
                       json_integer_value(json_object_get(parts, "failed"));
    progress_show(&watch->session->progress, PROGRESS_STAGE_FRAMES, (uint64_t)ended,
                  (uint64_t)json_integer_value(json_object_get(parts, "count")));
}

json_t *job_watch_wait(const struct job_watch *watch, struct failure *failure)
{
    for (;;) {
        json_t *job = session_get_json(watch->session, watch->path, watch->noun, failure);
        if (!job)
            return NULL;
        show(watch, job);
        if (job_has_ended(job) || waits_for_somebody(job))
            return job;
        json_decref(job);
        if (!interrupt_sleep(&watch->session->interrupt, POLL_MS, failure))
            return NULL;
    }
}

bool job_watch_judge(const struct job_watch *watch, const json_t *job, struct failure *failure)
{
    char why[FAILURE_MESSAGE_BYTES / 2];
    const json_t *problem = json_object_get(job, "problem");
    bool has_problem = json_is_object(problem);
    text_copy_printable(why, sizeof why,
                        has_problem ? job_text(problem, "detail") : "no reason is known");
    if (is_in_state(job, "done"))
        return true;
    if (is_in_state(job, "failed"))
        return fail(failure, EXIT_CODE_REFUSED, "%s failed: %s", watch->noun, why);
    if (is_in_state(job, "cancelled"))
        return fail(failure, EXIT_CODE_REFUSED, "%s was cancelled%s%s", watch->noun,
                    has_problem ? ": " : "", has_problem ? why : "");
    return fail(failure, EXIT_CODE_TEMPORARY, "%s %s: %s", watch->noun,
                is_paused(job) ? "is paused" : "has not begun", why);
}
